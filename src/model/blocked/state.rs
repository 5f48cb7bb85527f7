//! The engine as a stream of bytes, with the interior at the level of the surface.

use std::io;

use serde::{Deserialize, Serialize};

use super::{Engine, domain::Theory, lane::BLOCK, strengths::FoundRatios, tiles::RowPeak};
use crate::{
    model::{InterfacePeaks, Tension, cone::ConeState, strain::CellPeak},
    state::{StateError, StateReader, StateWriter},
};

/// What the engine keeps beside the field.
#[derive(Serialize, Deserialize)]
struct EngineState {
    cone: ConeState,
    peaks: [RowPeak; 2],
    strain: CellPeak,
    tensions: Vec<Tension>,
    tractions: Vec<InterfacePeaks>,
    ratios: FoundRatios,
}

impl<T, S: Theory> Engine<T, S> {
    /// Columns that have been written to, whole blocks; never fewer than at a level before.
    fn written_columns(&self) -> usize {
        self.cone.active_columns().next_multiple_of(BLOCK).min(self.field.domain().levels.columns())
    }

    pub(super) fn write_state(&mut self, out: &mut StateWriter<'_>) -> io::Result<()> {
        assert!(self.steps.is_empty(), "{} steps have not been returned", self.steps.len());
        self.catch_up();
        out.put(&EngineState {
            cone: self.cone.state(),
            peaks: self.peaks,
            strain: self.strains.peak(),
            tensions: self.field.domain().interfaces.tensions(),
            tractions: self.field.domain().interfaces.peaks(),
            ratios: self.field.domain().ratios.found(),
        })?;
        self.field.save(self.written_columns(), out)
    }

    pub(super) fn read_state(&mut self, level: usize, from: &mut StateReader<'_>) -> Result<(), StateError> {
        assert!(self.level == 0, "a target that has moved");
        let EngineState { cone, peaks, strain, tensions, tractions, ratios } = from.get()?;
        self.cone.set(level, cone)?;
        for peak in peaks {
            StateError::unless(peak.level <= level, "step of the largest strain on the backing", peak.level)?;
            StateError::unless(peak.column < self.grid.nr(), "column of that strain", peak.column)?;
        }
        let [rows, columns] = [self.grid.nz, self.grid.nr()];
        StateError::unless(strain.level <= level, "step of the largest strain", strain.level)?;
        StateError::unless(strain.row < rows, "row of that strain", strain.row)?;
        StateError::unless(strain.column < columns, "column of that strain", strain.column)?;
        self.strains.note(strain);
        for tension in tensions {
            let Tension { interface, level: earlier, .. } = tension;
            StateError::unless(earlier <= level, "step of the first tension at an interface", earlier)?;
            StateError::unless(interface + 1 < self.grid.layers.len(), "number of an interface", interface)?;
            self.field.domain().interfaces.note(tension);
        }
        let interfaces = tractions.len();
        StateError::unless(interfaces < self.grid.layers.len(), "number of interfaces", interfaces)?;
        for (interface, peaks) in tractions.into_iter().enumerate() {
            for peak in [peaks.tension, peaks.shear] {
                StateError::unless(peak.level <= level, "step of the largest traction", peak.level)?;
                StateError::unless(peak.column < columns, "column of that traction", peak.column)?;
            }
            self.field.domain().interfaces.note_peaks(interface, peaks);
        }
        let bonds = self.field.domain().ratios.found().largest.bonds.len();
        for peaks in [&ratios.largest, &ratios.first] {
            StateError::unless(peaks.bonds.len() == bonds, "number of bonds", peaks.bonds.len())?;
            for peak in peaks.all() {
                StateError::unless(peak.step <= level as u64, "step of the largest ratio", peak.step)?;
            }
        }
        self.field.domain().ratios.set(ratios);
        (self.level, self.reached, self.peaks) = (level, level, peaks);
        self.field.load(self.written_columns(), from)
    }
}

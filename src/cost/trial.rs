//! When a case stops and how much its messages pack, tried on a coarser mesh: on a fine mesh fields look much the same.

use super::Work;
use crate::{
    case::{Case, CaseErrors, Stop},
    channels::Size,
    recording::Compression,
    session,
};

/// Largest trial: node updates, bytes of messages; or a tenth of the case, if that is more.
const MOST_UPDATES: f64 = 3e7;
const MOST_BYTES: u64 = 64 << 20;

/// Fractions of the cells that are tried.
const FRACTIONS: [usize; 10] = [1, 2, 3, 4, 5, 8, 10, 16, 20, 40];

/// What a recording takes beside its messages: schemas, attachments, metadata \[bytes\].
const FRAMEWORK: f64 = 64e3;

/// Sizes of messages after compression, relative to before, where there is no trial: numbers and views.
fn ratios(compression: Compression) -> (f64, f64) {
    match compression {
        Compression::None => (1.0, 1.0),
        Compression::Lz4 => (0.93, 0.22),
        Compression::Zstd => (0.85, 0.10),
    }
}

/// What a trial has shown of a case.
#[derive(Clone, Copy, Debug)]
pub struct Trial {
    /// Part of the run after which its stop condition comes true; 1 if it does not.
    pub part: f64,
    /// Size of numbers after compression, relative to before.
    numbers: f64,
    /// Size of views after compression, relative to before.
    views: f64,
}

impl Trial {
    /// Tries a case, if it can be learnt from.
    ///
    /// * `work`: its work
    /// * `coarser`: the case on a mesh of so many cells, with every so many nodes of a field
    pub fn of(case: &Case, work: &Work, coarser: impl Fn(usize, usize) -> Result<Case, CaseErrors>) -> Self {
        let (numbers, views) = ratios(case.record.compression);
        let usual = Self { part: 1.0, numbers, views };
        if case.record.compression == Compression::None && case.run.stop == Stop::Never {
            return usual;
        }
        try_out(case, work, usual, coarser).unwrap_or(usual)
    }

    /// Size of a recording \[bytes\].
    ///
    /// * `messages`: sizes of its messages before compression
    pub fn file_size(&self, messages: Size) -> f64 {
        FRAMEWORK + self.numbers * messages.numbers as f64 + self.views * messages.views as f64
    }
}

/// Records a case small enough, and one half as fine. None if there is none, or it fails: then a run would say why.
fn try_out(
    case: &Case,
    work: &Work,
    usual: Trial,
    coarser: impl Fn(usize, usize) -> Result<Case, CaseErrors>,
) -> Option<Trial> {
    let most_updates = MOST_UPDATES.max(work.updates / 10.0);
    let most_bytes = MOST_BYTES.max(work.messages.total() / 10);
    let (cells, every) = (case.mesh.cells, case.record.field_every);
    // none if that is too coarse for a case
    let by = |fraction: usize| coarser(cells / fraction, every.div_ceil(fraction)).ok();
    let (fraction, case, tried) = FRACTIONS.into_iter().find_map(|fraction| {
        let case = by(fraction)?;
        let Work { updates, messages, .. } = Work::of(&case);
        (updates <= most_updates && messages.total() <= most_bytes).then_some((fraction, case, messages))
    })?;
    let trial = numbers_of(&case)?;
    let mut numbers = trial.ratio;
    if fraction > 1
        && let Some(coarse) = by(2 * fraction).and_then(|case| numbers_of(&case))
    {
        // finer fields are smoother; where they pack less, the mesh was too coarse to show anything
        numbers -= (coarse.ratio - trial.ratio).max(0.0) * trend(fraction as f64);
    }
    let views = if work.messages.views == 0 {
        usual.views
    } else {
        // what of a picture does not pack lies along lines, whose length grows as the root of the number of pixels
        let finer = work.messages.views as f64 / tried.views as f64;
        views_of(&case, &trial)? / finer.sqrt()
    };
    Some(Trial { part: trial.part, numbers: numbers.clamp(0.0, 1.0), views })
}

/// How much more numbers pack on a mesh `times` as fine, if twice as fine has made them pack by 1 more before, and every
/// doubling adds half of what the one before did: as found in cases of up to 1000 cells, within some percent.
fn trend(times: f64) -> f64 {
    1.0 - 1.0 / times
}

/// What a recording without views has shown.
struct Numbers {
    /// As [`Trial::part`].
    part: f64,
    /// Size after compression, relative to before.
    ratio: f64,
}

/// Records a case without its views. None if it fails.
fn numbers_of(case: &Case) -> Option<Numbers> {
    let mut case = case.clone();
    case.record.views.clear();
    let (part, messages, size) = record(&case)?;
    Some(Numbers { part, ratio: (size - FRAMEWORK) / messages.numbers as f64 })
}

/// Records a case with its views: their size after compression, relative to before. None if it fails.
fn views_of(case: &Case, numbers: &Numbers) -> Option<f64> {
    let (_, messages, size) = record(case)?;
    Some((size - FRAMEWORK - numbers.ratio * messages.numbers as f64) / messages.views.max(1) as f64)
}

/// Records a case: the part after which it ends, the sizes of its messages, and that of the file \[bytes\]. None if it fails.
fn record(case: &Case) -> Option<(f64, Size, f64)> {
    let file = tempfile::NamedTempFile::new().ok()?;
    let last_step = session::record(case, file.path()).ok()?;
    let part = last_step as f64 / case.sizes.steps as f64;
    let size = file.as_file().metadata().ok()?.len() as f64;
    Some((part, Work::up_to(case, part).messages, size))
}

//! The recording of a case: an observer that turns its views into a file.
//!
//! The status is written last, also when a run fails; a recording without one has no end and does not claim to be
//! complete. Nothing from clock, host or thread count enters the file outside `percuss.host`, and that record always
//! has the same length, so that all offsets in the file repeat too.

use std::{
    collections::BTreeMap,
    path::Path,
    time::{SystemTime, UNIX_EPOCH},
};

use percuss_table::measures::{BODIES, Measure, Observations, RATIOS};
use serde::{Deserialize, Serialize};

use super::{Flow, Observer, RunError, Status};
use crate::{
    case::{Case, GradingFacts},
    channels::{Catalogue, log::Level},
    grid::{Back, Bond},
    layout::{self, LayoutBuilder},
    measuring::Measuring,
    recording::{
        Destination, FORMAT_VERSION, NUMERICS, Recorder, RecordingError, Tap, Written, copy::attachment,
    },
    units::Units,
    validity::{InterfacePeaks, Peak, STRAIN_LIMIT, Validity},
    view::View,
};

/// Source of the numbers of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// A computed run.
    Simulation,
    /// A closed form.
    Exact {
        /// Its name.
        form: &'static str,
        /// True if it has the drag.
        knows_drag: bool,
    },
}

impl Source {
    fn catalogue(self, case: &Case) -> Catalogue {
        match self {
            Self::Simulation => Catalogue::new(case),
            Self::Exact { knows_drag, .. } => Catalogue::exact(case, knows_drag),
        }
    }

    /// Its entries in the run record.
    fn entries(self) -> BTreeMap<String, String> {
        match self {
            Self::Simulation => {
                to_map([("source", "simulation".to_owned()), ("numerics", NUMERICS.to_string())])
            }
            Self::Exact { form, .. } => {
                to_map([("source", "exact".to_owned()), ("closed_form", form.to_owned())])
            }
        }
    }

    fn knows_drag(self) -> bool {
        !matches!(self, Self::Exact { knows_drag: false, .. })
    }

    fn noun(self) -> &'static str {
        match self {
            Self::Simulation => "run",
            Self::Exact { .. } => "closed form",
        }
    }
}

/// How much of a run is recorded.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Recorded {
    /// Last step that is recorded.
    pub step: u64,
    /// Its time \[R/c_p\].
    pub time: f64,
    /// Its messages up to there.
    pub written: Written,
    /// What was measured of them.
    pub seen: Observations,
    /// Values that sensors hold back to the end.
    pub held: Vec<Vec<f64>>,
}

/// Name of the attachment with the resolved case.
const RESOLVED_CASE: &str = "case.resolved.toml";

/// The resolved case that a recording or the part of one has; `None` if it has none that can be read.
pub fn recorded_case(path: &Path) -> Option<String> {
    attachment(path, RESOLVED_CASE)
}

/// Length to which `percuss.host` is padded \[bytes\].
const HOST_LENGTH: usize = 1024;

/// Records the steps that it observes, from the first record to the status.
///
/// ```text
/// percuss.run · percuss.host · attachments · channels · messages … · percuss.validity · percuss.mesh · percuss.summary · percuss.status
/// ```
pub struct Recording {
    recorder: Recorder,
    catalogue: Catalogue,
    measuring: Measuring,
    source: Source,
    case: Case,
    last: Option<(u64, f64)>,
    /// True if every step is handed to the writer at once.
    is_live: bool,
}

impl Recording {
    /// Begins a recording of `case`, with the case and its layout attached.
    ///
    /// # Errors
    ///
    /// The file exists, or cannot be written.
    pub fn create(destination: &Destination, case: &Case, source: Source) -> Result<Self, RecordingError> {
        let recorder = Recorder::create(destination, case.record.compression)?;
        let host = host_record(destination.reproducible, None);
        Self::begin(recorder, case, source, host)
    }

    /// Begins the recording of a run of `case` that continues: with the same head, and the messages that the run has recorded up
    /// to there.
    ///
    /// # Errors
    ///
    /// Nothing is left of that run, its messages are not whole, or the file cannot be written. What is left stays as it is.
    pub fn resume(
        destination: &Destination,
        case: &Case,
        recorded: &Recorded,
    ) -> Result<Self, RecordingError> {
        let (recorder, left) = Recorder::resume(destination, case.record.compression)?;
        let host = host_record(destination.reproducible, Some(recorded.step));
        let mut recording = Self::begin(recorder, case, Source::Simulation, host)?;
        recording.recorder.copy(left, recorded.written.clone())?;
        recording.measuring.seen = recorded.seen.clone();
        for (held, values) in recording.catalogue.held().zip(&recorded.held) {
            held.clone_from(values);
        }
        recording.last = Some((recorded.step, recorded.time));
        Ok(recording)
    }

    /// * `host`: see [`host_record`]
    fn begin(
        mut recorder: Recorder,
        case: &Case,
        source: Source,
        host: BTreeMap<String, String>,
    ) -> Result<Self, RecordingError> {
        let mut run = run_record(case);
        run.extend(source.entries());
        recorder.metadata("percuss.run", run)?;
        recorder.metadata("percuss.host", host)?;
        recorder.attach("case.toml", "application/toml", case.text().into_bytes())?;
        let resolved = case.resolved_toml().into_bytes();
        recorder.attach(RESOLVED_CASE, "application/toml", resolved)?;
        let catalogue = source.catalogue(case);
        let layout = LayoutBuilder::new(case, &catalogue.topics()).lichtblick().into_bytes();
        recorder.attach(layout::ATTACHMENT, "application/json", layout)?;
        recorder.channels(catalogue.specs())?;
        Ok(Self {
            measuring: Measuring::new(case.units(), source.knows_drag()),
            source,
            case: case.clone(),
            last: None,
            is_live: false,
            recorder,
            catalogue,
        })
    }

    /// Also hands every message to `tap`, step by step.
    ///
    /// # Errors
    ///
    /// The first error of the recorder.
    pub fn tap(&mut self, tap: Box<dyn Tap>) -> Result<(), RecordingError> {
        self.is_live = true;
        self.recorder.tap(tap)
    }

    /// Brings all messages so far onto the disk.
    ///
    /// # Errors
    ///
    /// The first error of the recorder.
    pub(crate) fn seal(&mut self) -> Result<Recorded, RecordingError> {
        let (step, time) = self.last.unwrap_or_default();
        let (written, seen) = (self.recorder.seal()?, self.measuring.seen.clone());
        let held = self.catalogue.held().map(|values| values.clone()).collect();
        Ok(Recorded { step, time, written, seen, held })
    }

    pub(crate) fn measures(&self, validity: &Validity) -> Vec<Measure> {
        self.measuring.measures(validity)
    }

    /// What was measured, and the subjects of the warnings; what was not is left out.
    fn summary_record(&self, validity: &Validity) -> BTreeMap<String, String> {
        let entry = |Measure { name, value, .. }: Measure| Some((name.into_owned(), value?.to_string()));
        let warnings = self.measuring.seen.warnings();
        let subjects = warnings.iter().map(String::as_str).collect::<Vec<_>>().join(",");
        let warned = (!subjects.is_empty()).then(|| ("warnings".to_owned(), subjects));
        self.measures(validity).into_iter().filter_map(entry).chain(warned).collect()
    }

    fn validity_record(&self, validity: &Validity) -> BTreeMap<String, String> {
        let Units { length, time, speed, stress, .. } = self.case.units();
        let mut map = BTreeMap::new();
        let mut peak = |name: &str, peak: &Peak, value: f64| {
            map.insert(name.to_owned(), value.to_string());
            map.insert(format!("{name}.step"), peak.step.to_string());
            map.insert(format!("{name}.time"), time.of(peak.time).to_string());
            map.insert(format!("{name}.r"), length.of(peak.r).to_string());
            map.insert(format!("{name}.z"), length.of(peak.z).to_string());
        };
        peak("largest_pressure", &validity.pressure, stress.of(validity.pressure.value));
        peak("largest_strain", &validity.strain, validity.strain.value);
        peak("largest_strain_at_probes", &validity.probes, validity.probes.value);
        for (name, ratio) in RATIOS.into_iter().zip([&validity.yield_ratio, &validity.tensile_ratio]) {
            ratio.iter().for_each(|ratio| peak(name, ratio, ratio.value));
        }
        for (body, interfaces) in BODIES.into_iter().zip(&validity.interfaces) {
            for (number, InterfacePeaks { tension, shear, ratio }) in (1..).zip(interfaces) {
                let name = format!("{body}interface.{number}");
                peak(&format!("{name}.tension"), tension, stress.of(tension.value));
                shear.iter().for_each(|shear| peak(&format!("{name}.shear"), shear, stress.of(shear.value)));
                ratio.iter().for_each(|ratio| peak(&format!("{name}.ratio"), ratio, ratio.value));
            }
        }
        map.insert("strain_limit".into(), STRAIN_LIMIT.to_string());
        let is_impact = validity.velocity > 0.0;
        if is_impact {
            map.insert("impact_velocity".into(), speed.of(validity.velocity).to_string());
        }
        map.extend(validity.mesh_loss.map(|share| ("mesh_loss".into(), share.to_string())));
        let velocities = [
            ("admissible_velocity", validity.admissible_velocity()),
            ("admissible_velocity_at_probes", validity.admissible_velocity_at_probes()),
        ];
        for (name, velocity) in velocities {
            let Some(velocity) = velocity else { continue };
            map.insert(name.into(), velocity.to_string());
            if self.case.scales.is_some() {
                map.insert(format!("{name}_m_per_s"), speed.of(velocity).to_string());
            }
        }
        let note = if !is_impact {
            "strains are proportional to the force of the load"
        } else if validity.admissible_velocity().is_some() {
            "strains under a flat face are proportional to V0; at its sharp edge they grow with the mesh as dr^(-1/2), at probes beside it they do not"
        } else {
            "strains under a head that is not flat are not proportional to V0: `percuss check CASE --admissible` searches for the velocity by trials"
        };
        map.insert("admissible_velocity.note".into(), note.into());
        map
    }
}

impl Observer for Recording {
    fn observe(&mut self, view: &View<'_>) -> Result<Flow, RunError> {
        if self.last.is_none() {
            // the version is in the metadata: here it would make every release differ from every other
            let text = format!("{} of {} steps begins", self.source.noun(), self.case.sizes.steps);
            self.catalogue.say(Level::Info, view.time, &text, &mut self.recorder)?;
        }
        self.catalogue.observe(view, &mut self.recorder)?;
        self.measuring.take(view);
        self.last = Some((view.step, view.time));
        self.recorder.end_step();
        if self.is_live {
            self.recorder.hand_over()?;
        }
        Ok(Flow::Continue)
    }

    /// Writes the last log line, validity, measures, status and the summary of the file.
    fn end(&mut self, status: &Status, validity: &Validity) -> Result<(), RunError> {
        self.catalogue.release(&mut self.recorder)?;
        let (step, time) = self.last.unwrap_or((0, 0.0));
        let level = if matches!(status, Status::Failed(_)) { Level::Error } else { Level::Info };
        let text = format!("{}: {}", status.name(), status.message());
        self.catalogue.say(level, time, &text, &mut self.recorder)?;
        self.recorder.metadata("percuss.validity", self.validity_record(validity))?;
        if let Some(mut mesh) = mesh_record(&self.case) {
            let met = 2.0 * validity.drag.r / self.case.sizes.dr;
            mesh.insert("contact_cells_met".into(), met.to_string());
            self.recorder.metadata("percuss.mesh", mesh)?;
        }
        self.recorder.metadata("percuss.summary", self.summary_record(validity))?;
        let entries = [
            ("status", status.name().to_owned()),
            ("message", status.message().to_owned()),
            ("last_step", step.to_string()),
            ("last_time", self.case.units().time.of(time).to_string()),
            ("steps", self.case.sizes.steps.to_string()),
        ];
        self.recorder.metadata("percuss.status", to_map(entries))?;
        Ok(self.recorder.finish(status.is_finished())?)
    }
}

fn to_map<'a>(entries: impl IntoIterator<Item = (&'a str, String)>) -> BTreeMap<String, String> {
    entries.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
}

/// The computed case: the same for every repetition of a run.
fn run_record(case: &Case) -> BTreeMap<String, String> {
    let (sizes, Units { length, time, .. }) = (&case.sizes, case.units());
    let name = |value: serde_json::Value| value.as_str().unwrap_or_default().to_owned();
    let json = case.resolved_json();
    let mut map = to_map([
        ("format_version", FORMAT_VERSION.to_owned()),
        ("percuss_version", env!("CARGO_PKG_VERSION").to_owned()),
        ("title", case.title.clone()),
        ("model", name(json["model"].clone())),
        ("geometry", name(json["geometry"].clone())),
        ("contact", name(json["impact"]["contact"].clone())),
        ("mesh", name(json["mesh"]["kind"].clone())),
        ("damping", case.mesh.damping.to_string()),
        ("dr", length.of(sizes.dr).to_string()),
        ("dz", length.of(sizes.dz).to_string()),
        ("dt", time.of(sizes.dt).to_string()),
        ("nr", sizes.nr.to_string()),
        ("nz", sizes.nz.to_string()),
        ("steps", sizes.steps.to_string()),
        ("playback_rate", case.record.playback_rate.to_string()),
    ]);
    map.extend(layer_entries(case));
    map.extend(case.mesh.order.map(|order| ("order".to_owned(), u8::from(order).to_string())));
    map.insert("units".into(), if case.scales.is_some() { "SI" } else { "dimensionless" }.into());
    let scales = case.scales.into_iter().flat_map(|scales| scales.entries());
    map.extend(scales.map(|(name, value)| (name.to_owned(), value.to_string())));
    map
}

/// How a graded mesh was made, if it is one.
fn mesh_record(case: &Case) -> Option<BTreeMap<String, String>> {
    let GradingFacts { grading, wavelengths: [surface, middle, back], work } = case.grading_facts()?;
    let length = |x: f64| case.units().length.of(x).to_string();
    let [near_radius, near_depth] = grading.near.map(length);
    Some(to_map([
        ("contact_cells", grading.contact_cells.to_string()),
        ("grading", grading.ratio.to_string()),
        ("near_radius", near_radius),
        ("near_depth", near_depth),
        ("ten_node_wavelength.surface", length(surface)),
        ("ten_node_wavelength.middle", length(middle)),
        ("ten_node_wavelength.back", length(back)),
        ("work_ratio", work.to_string()),
    ]))
}

/// What was computed of a target that is not a single layer or half-space on a rigid base: layers, from the struck surface down, and the back.
fn layer_entries(case: &Case) -> BTreeMap<String, String> {
    let mut map = BTreeMap::new();
    if case.target.back == Back::Free {
        map.insert("back".to_owned(), "free".to_owned());
    }
    let layers = case.target.computed();
    if layers.len() == 1 {
        return map;
    }
    let Units { length, speed, .. } = case.units();
    let density = case.scales.map_or(1.0, |scales| scales.density);
    map.insert("layers".to_owned(), layers.len().to_string());
    let grid = case.grid();
    let rows = grid.layers.iter().zip(&case.sizes.layers);
    for (number, (layer, (rows, sizes))) in (1..).zip(layers.iter().zip(rows)) {
        let bond = match layer.bond {
            Bond::Welded => "welded",
            Bond::Sliding => "sliding",
        };
        let mut put = |key: &str, value: String| map.insert(format!("layer.{number}.{key}"), value);
        put("name", layer.name.clone());
        put("top", length.of(rows.top).to_string());
        put("bottom", length.of(grid.bottom(rows)).to_string());
        put("density", (density * layer.density).to_string());
        put("wave_speed", speed.of(layer.wave_speed).to_string());
        put("shear_wave_speed", speed.of(layer.waves.shear).to_string());
        if !layer.stiffness.is_isotropic() {
            let lateral = layer.wave_speed * layer.stiffness.lateral.sqrt();
            put("lateral_wave_speed", speed.of(lateral).to_string());
        }
        put("impedance", (density * speed.scale * layer.waves.impedance).to_string());
        put("rows", rows.steps.to_string());
        put("speed_change", sizes.speed_change.to_string());
        put("bond", bond.to_owned());
    }
    map
}

/// A time as a date, in the years that have one of four digits; a clock may be set to any.
fn date(time: SystemTime) -> String {
    /// Seconds from 1970 to the year 10000.
    const END: u64 = 253_402_300_800;
    match time.duration_since(UNIX_EPOCH) {
        Ok(since) if since.as_secs() < END => humantime::format_rfc3339_seconds(time).to_string(),
        Ok(since) => format!("{} s after 1970", since.as_secs()),
        Err(error) => format!("{} s before 1970", error.duration().as_secs()),
    }
}

/// Place, time and program of the computation, padded to a fixed length.
///
/// * `reproducible`: says nothing of all that
/// * `resumed`: step after which it was resumed
fn host_record(reproducible: bool, resumed: Option<u64>) -> BTreeMap<String, String> {
    let clip = |text: String| text.chars().take(100).collect::<String>();
    let mut map = BTreeMap::new();
    if !reproducible {
        let build = if cfg!(debug_assertions) { "debug" } else { "release" };
        map = to_map([
            ("start_time", date(SystemTime::now())),
            ("host", clip(gethostname::gethostname().to_string_lossy().into_owned())),
            ("threads", rayon::current_num_threads().to_string()),
            ("build", format!("{build} {} {}", std::env::consts::ARCH, std::env::consts::OS)),
        ]);
        map.extend(percuss_output::COMMIT.map(|commit| ("commit".to_owned(), clip(commit.to_owned()))));
        map.extend(resumed.map(|step| ("resumed_after_step".to_owned(), step.to_string())));
    }
    let used: usize = map.iter().map(|(key, value)| key.len() + value.len()).sum();
    let padding = HOST_LENGTH.saturating_sub(used + "padding".len());
    map.insert("padding".into(), " ".repeat(padding));
    map
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn any_clock_has_a_time() {
        let after = |seconds| UNIX_EPOCH + Duration::from_secs(seconds);
        assert_eq!(date(after(0)), "1970-01-01T00:00:00Z");
        assert_eq!(date(after(253_402_300_799)), "9999-12-31T23:59:59Z");
        assert_eq!(date(after(253_402_300_800)), "253402300800 s after 1970");
        assert_eq!(date(UNIX_EPOCH - Duration::from_secs(7)), "7 s before 1970");
    }
}

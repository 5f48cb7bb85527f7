//! From values to a case: the rules between keys, what follows from them, and the defaults that depend on sizes.

use std::path::Path;

use super::{
    Body, Case, CaseBuilder, CaseErrors, Frames, Parameters, Record, Sizes, Target,
    document::Document,
    gauges, grading, indenter,
    keys::{BODY, SIZE},
    load,
    numbers::{Bounds, Numbers},
    target,
    values::{Checked, Values},
};
use crate::{
    contact::load::Load,
    geometry::Geometry,
    grid::{Back, MeshKind},
    material::Strengths,
    model::{Field, elastic},
    units::{Dimension, STANDARD_GRAVITY},
};

/// Default of `record.layer_tension` \[Z·V0 of the struck layer\].
const LAYER_TENSION: f64 = 0.01;
/// Probes of the paper's figures, in largest contact radii.
const DEFAULT_PROBES: [f64; 5] = [0.0, 0.5, 0.9, 0.95, 0.99];
/// Damping of waves along r in model `elastic`: it takes the noise of moving edges over soft targets down with the mesh. Less where
/// that is not stable, from c_s/c_p = 0.8427 on.
const DEFAULT_LATERAL_DAMPING: f64 = 0.5;
const LONGEST_TITLE: usize = 1000;

pub(super) fn case(given: CaseBuilder) -> Result<Case, CaseErrors> {
    let document = Document::new(&given);
    let mut values = Values::read(&document)?;
    let profile = values.get::<String>("indenter.file").map(|file| given.folder.join(file));
    check_title(&mut values, &given.name);
    let target = target::target(&mut values);
    let load = if values.is_loaded { load::load(&mut values, &given.folder) } else { None };
    let mut indenter = match values.is_loaded {
        true => load.as_ref().map(Load::body),
        false => {
            fall(&mut values);
            indenter::indenter(&mut values, &given.folder)
        }
    };
    if let (Some(indenter), Some(target)) = (&mut indenter, &target) {
        indenter.striker = target::striker(&mut values, indenter, target);
        if let Some(striker) = indenter.striker.as_ref().filter(|_| values.is_table(BODY.path)) {
            indenter.mass = striker.mass(values.system.geometry);
        }
    }
    indenter::check_bounces(&mut values, indenter.as_ref());
    check_mesh(&mut values, target.as_ref(), indenter.as_ref());
    check_record(&mut values, target.as_ref(), indenter.as_ref());
    // sizes are derived from sound values only
    let parts = target.zip(indenter).filter(|_| document.is_sound());
    let parameters = parts.and_then(|(target, indenter)| {
        let geometry = values.get("geometry").unwrap_or(Geometry::Axisymmetric);
        let mut case = Parameters {
            title: values.get("title")?,
            model: values.model,
            geometry,
            scales: values.system.scales,
            target,
            indenter,
            impact: match load {
                Some(_) => Load::impact(),
                None => values.section("impact"),
            },
            load,
            mesh: values.section("mesh"),
            run: values.section("run"),
            record: record(&values)?,
            sizes: Sizes::default(),
            resolved: Checked::new(),
        };
        case.grade(&mut values)?;
        case.sizes = case.derive_sizes(&values)?;
        case.check_bands(&values)?;
        case.complete(&mut values);
        case.resolved = values.checked.clone();
        Some(case)
    });
    let parameters = document.finish(parameters)?;
    Ok(Case { parameters, given, profile })
}

fn check_title(values: &mut Values<'_>, name: &str) {
    match values.get::<String>("title") {
        None => {
            let stem = Path::new(name).file_stem().unwrap_or_default();
            values.set("title", stem.to_string_lossy().into_owned());
        }
        Some(title) if title.chars().count() > LONGEST_TITLE => {
            let message = format!("`title` has {} characters", title.chars().count());
            values.problem("title", message, format!("allowed: {LONGEST_TITLE} characters at most"));
        }
        Some(_) => {}
    }
}

/// The velocity V0 = √(2gh) of a fall.
fn fall(values: &mut Values<'_>) {
    if values.system.numbers == Numbers::Physical && !values.is_given("impact.drop") {
        let meaning = "a speed such as \"5 m/s\"; or drop, the height of a fall, as \"0.5 m\"";
        values.need("impact.velocity", meaning);
    }
    let height = values.take("impact.drop");
    let Some((height, scales)) = height.zip(values.system.scales) else { return };
    let si = (2.0 * STANDARD_GRAVITY * scales.expand(Dimension::Length, height)).sqrt();
    let velocity = scales.reduce(Dimension::Speed, si);
    if SIZE.contain(velocity) {
        values.set("impact.velocity", velocity);
    } else {
        let what = format!(", which makes V0 = {si:.4e} m/s");
        let help = format!("allowed: V0 {}", SIZE.in_unit(scales.speed, "m/s"));
        values.refuse("impact.drop", &what, &help);
    }
}

/// What mesh and scheme leave open.
fn check_mesh(values: &mut Values<'_>, target: Option<&Target>, indenter: Option<&Body>) {
    let is_paper = values.get("mesh.kind") == Some(MeshKind::Paper);
    let is_elastic = values.model.has_shear();
    grading::choose(values, indenter);
    if is_paper && (is_elastic || target.is_some_and(|target| !target.is_simple())) {
        let what = " needs model = \"rakhmatulin\" and a target of one layer with a rigid back";
        values.refuse("mesh.kind", what, "leave the key out: all others have the matched mesh");
        return;
    }
    if is_paper {
        for (name, only) in
            [("mesh.order", toml::Value::Integer(2)), ("mesh.damping", toml::Value::Float(0.0))]
        {
            if values.is_given(name) && values.checked.get(name).is_some_and(|value| *value != only) {
                let what = format!(" needs the matched mesh; the paper's has {only}");
                values.refuse(name, &what, "leave the key out, or use mesh.kind = \"matched\"");
            }
            values.set(name, only);
        }
    }
    if is_elastic {
        // one σ for all layers
        let striker = indenter.and_then(|indenter| indenter.striker.as_ref());
        let bodies = target.into_iter().chain(striker.map(|striker| &striker.body));
        let ratio = bodies.map(Target::largest_ratio).reduce(f64::max);
        let largest = ratio.map_or(elastic::LARGEST_DAMPING, elastic::largest_damping);
        if values.number("mesh.damping").is_some_and(|damping| damping > largest) {
            let ratio = (1e4 * ratio.unwrap_or_default()).round() / 1e4;
            // no number that is refused is offered
            let offered = Bounds::within(0.0, (1e4 * largest).floor() / 1e4);
            let what = format!(" is not stable at c_s/c_p = {ratio}");
            values.refuse("mesh.damping", &what, &format!("allowed: {offered}"));
        }
        let damping = values.number("mesh.damping").unwrap_or(DEFAULT_LATERAL_DAMPING.min(largest));
        values.set("mesh.damping", damping);
    }
}

fn check_record(values: &mut Values<'_>, target: Option<&Target>, indenter: Option<&Body>) {
    let is_single = target.is_some_and(|target| target.layers.len() < 2);
    if is_single && values.layer_paths(BODY.path).len() < 2 {
        let what = " is of the interfaces of several layers, and the target has one";
        values.unwanted("record.layer_tension", what, "leave it out, or give target.layer");
    }
    let fields = values.get::<Vec<Field>>("record.fields").unwrap_or_default();
    let lacks = |field: &&Field| !field.belongs_to(values.model);
    if let Some(field) = fields.iter().find(lacks) {
        let message =
            format!("`record.fields` names {:?}, which model = \"rakhmatulin\" does not have", field.name());
        let help = format!(
            "allowed: {}; model = \"elastic\" has them all",
            Field::AXIAL.map(Field::name).join(", ")
        );
        values.problem("record.fields", message, help);
    } else if let (Some(target), Some(indenter)) = (target, indenter) {
        let bodies = [target].into_iter().chain(indenter.striker.as_ref().map(|striker| &striker.body));
        let mut strengths = bodies.flat_map(|body| &body.layers).map(|layer| &layer.strengths);
        let is_known = |of: &Strengths| of.yield_strength.or(of.tensile_strength).is_some();
        if fields.contains(&Field::DamageRatio) && !strengths.any(is_known) {
            let message = "`record.fields` names \"damage_ratio\", and no strength of a layer is known";
            let help = "leave it out, or give a material of the target yield_strength or tensile_strength; \
                        `percuss materials` lists those that have them";
            values.problem("record.fields", message, help);
        }
    }
    // a placeholder for the end time is no bound
    let end_time = values.number("run.end_time").filter(|_| values.document.is_sound());
    let times = values.get::<Vec<f64>>("record.frame_times").unwrap_or_default();
    if let Some(late) = times.iter().position(|time| end_time.is_some_and(|end| *time > end)) {
        let help = format!("allowed: up to run.end_time = {}", values.written("run.end_time"));
        values.refuse(&format!("record.frame_times[{late}]"), " is after the end of the run", &help);
    }
    let striker = indenter.and_then(|indenter| indenter.striker.as_ref());
    let height = striker.map(|striker| striker.body.thickness.unwrap_or(f64::INFINITY));
    // after a problem with the indenter nothing is known of its body
    if indenter.is_some() {
        gauges::check_depths(values, target.and_then(|target| target.thickness), height);
    }
    gauges::check_sensors(values, target);
    if values.number("record.playback_rate").is_none() {
        let end_time = values.number("run.end_time").unwrap_or(1.0);
        let rate = values.system.scales.map_or(1.0, |scales| {
            // the power of ten that plays the run in 2 to 20 s
            let seconds = end_time * scales.of(Dimension::Time);
            let mut powers = (-9..=12).map(|power| 10f64.powi(power));
            powers.find(|rate| rate * seconds >= 2.0).unwrap_or(1e12)
        });
        values.set("record.playback_rate", rate);
    }
}

/// Channels and frames; placeholders stand for what follows from the sizes, see [`Parameters::complete`].
fn record(values: &Values<'_>) -> Option<Record> {
    let frame_times = values.get("record.frame_times").map(Frames::At);
    Some(Record {
        interface_every: values.get("record.interface_every")?,
        probes: values.get("record.probes").unwrap_or_default(),
        layer_tension: values.number("record.layer_tension").unwrap_or_default(),
        points: values.get("record.points").unwrap_or_default(),
        lines: values.get("record.lines").unwrap_or_default(),
        sensors: gauges::sensors(values),
        fields: values.get("record.fields")?,
        r_max: values.number("record.r_max").unwrap_or(f64::INFINITY),
        field_every: values.get("record.field_every").unwrap_or(1),
        views: values.get("record.views")?,
        frames: frame_times.or_else(|| values.get("record.frames").map(Frames::Spread))?,
        compression: values.get("record.compression")?,
        playback_rate: values.number("record.playback_rate")?,
    })
}

impl Parameters {
    /// Sets what follows from the sizes, and its values.
    fn complete(&mut self, values: &mut Values<'_>) {
        if self.target.radius.is_none() {
            values.set("mesh.outer_radius", self.sizes.outer_radius);
        }
        self.complete_grading(values);
        if values.number("record.layer_tension").is_none() {
            let struck = match &self.load {
                Some(load) => load.force.largest() / self.likely_radius().powi(2),
                None => self.impact.velocity,
            };
            let tension = values.system.default(Dimension::Stress, LAYER_TENSION * struck);
            self.record.layer_tension = tension;
            values.set("record.layer_tension", tension);
        }
        if !values.is_given("record.probes") {
            self.record.probes = self.default_probes().to_vec();
        }
        if !values.is_given("record.r_max") {
            self.record.r_max = self.default_r_max();
        }
        if !values.is_given("record.field_every") {
            self.record.field_every = self.default_field_every();
        }
        let Record { probes, r_max, field_every, .. } = &self.record;
        values.set("record.probes", probes.clone());
        values.set("record.r_max", *r_max);
        values.set("record.field_every", *field_every as i64);
        // what stands for nothing, or, as the mass of layers, follows from other keys
        let Self { target, record, .. } = self;
        for (name, is_silent) in [
            ("indenter.mass", values.is_table(BODY.path)),
            ("indenter.body.layer.1.bond", true),
            ("target.layer", target.layers.len() == 1),
            ("target.layer.1.bond", true),
            ("target.back", target.back == Back::Rigid),
            ("target.rim", target.radius.is_none()),
            ("run.bounces", self.run.bounces == 1),
            ("record.layer_tension", self.sizes.interfaces() == [0; 2]),
            ("record.points", record.points.is_empty()),
            ("record.lines", record.lines.is_empty()),
        ] {
            if is_silent {
                values.checked.remove(name);
            }
        }
    }

    /// Default of `record.probes` \[R\]: of three digits in the unit in which the case is recorded.
    fn default_probes(&self) -> [f64; 5] {
        let unit = self.scales.map_or(1.0, |scales| scales.of(Dimension::Length));
        let radius = self.likely_radius() * unit;
        let rounded = |share: f64| format!("{:.2e}", share * radius).parse::<f64>().expect("a number");
        DEFAULT_PROBES.map(|share| rounded(share) / unit)
    }
}

//! From a document to a case: every key, its default and its bounds.
//!
//! After a problem reading continues with a placeholder, so that one pass finds all of them; placeholders never leave this
//! module, because a document with problems yields no case.

use std::{fmt, path::Path};

use serde::de::DeserializeOwned;

use super::{
    Case, CaseBuilder, CaseErrors, Frames, Impact, Mesh, Parameters, Record, Run, Stop, Target, ViewChannel,
    bounds::{Bounds, HUGE, TINY},
    document::{Document, Given, Section, Span, span_of, value},
    gauges,
    read_indenter::{IndenterParts, read_indenter},
    read_layers::{GivenTarget, TargetSections},
    read_target::read_system,
    sizes::{GivenMesh, Plan},
    system::System,
};
use crate::{
    contact::Rule,
    geometry::Geometry,
    grid::MeshKind,
    model::{
        Field, ModelKind, elastic,
        scheme::{LARGEST_DAMPING, Order},
    },
    recording::Compression,
    units::Dimension,
};

/// Default of `record.layer_tension` [Z·V0 of the struck layer].
const LAYER_TENSION: f64 = 0.01;
/// Probes of the paper's figures, in largest contact radii.
const DEFAULT_PROBES: [f64; 5] = [0.0, 0.5, 0.9, 0.95, 0.99];
const DEFAULT_CELLS: u64 = 100;
const DEFAULT_FRAMES: u64 = 200;
/// Damping of oblique waves that the mesh does not resolve: more of it takes out no more noise, and no front widens by it.
const DEFAULT_DAMPING: f64 = 1.0;

/// Damping of waves along r in model `elastic`: it takes the noise of moving edges over soft targets down with the mesh. Less where
/// that is not stable, from c_s/c_p = 0.8427 on.
const DEFAULT_LATERAL_DAMPING: f64 = 0.5;

/// Reads and checks a case.
pub(super) fn case(given: CaseBuilder) -> Result<Case, CaseErrors> {
    let document = Document::new(&given);
    let mut root = document.root()?;

    let title = read_title(&mut root);
    let model = root.get("model", "rakhmatulin, elastic").map_or(ModelKind::Rakhmatulin, value);
    let geometry = root.get("geometry", "axisymmetric, plane").map_or(Geometry::Axisymmetric, value);
    let [target, indenter, impact, mesh, run, record] =
        ["target", "indenter", "impact", "mesh", "run", "record"].map(|name| root.section(name));
    let has_quantities =
        [(&impact, "velocity"), (&run, "end_time"), (&indenter, "radius"), (&indenter, "nose_radius")]
            .into_iter()
            .any(|(section, key)| section.text(key).is_some())
            || root.has("length_unit");
    let mut target = TargetSections::new(target, geometry, model);
    let material = target.read_material(has_quantities);
    let (system, has_length_unit) = read_system(&mut root, &indenter, geometry, &material);
    root.end();
    let target = target.read(&material, &system);
    let impact = read_impact(impact, &system);
    let parts = IndenterParts {
        folder: &given.folder,
        geometry,
        system: &system,
        velocity: impact.velocity,
        contact: impact.contact.as_ref(),
    };
    let profile = indenter.text("file").map(|file| given.folder.join(file));
    let indenter = read_indenter(indenter, &parts);
    let impact = Impact {
        velocity: impact.velocity.unwrap_or(1.0),
        contact: impact.contact.map_or(Rule::Unilateral, value),
    };
    let sound = target.as_ref().map(|given| &given.target);
    let mesh = read_mesh(mesh, model, sound, &system);
    let (run, end_time) = read_run(run, &system);
    let (record, derived) = read_record(record, run.end_time, model, sound, &system);

    // sizes are derived from sound values only
    let parts = target.zip(indenter).filter(|_| document.is_sound());
    let parameters = parts.and_then(|(GivenTarget { target, thicknesses }, indenter)| {
        let plan = Plan {
            model,
            scales: system.scales(),
            target: &target,
            indenter: &indenter,
            impact,
            run,
            record: &record,
        };
        let sizes = plan.sizes(&document, &mesh, &thicknesses, end_time)?;
        let mut parameters = Parameters {
            title: title.unwrap_or_else(|| default_title(&given.name)),
            model,
            geometry,
            scales: system.scales(),
            has_length_unit,
            target,
            indenter,
            impact,
            mesh: Mesh {
                kind: mesh.kind,
                cells: mesh.cells.value as usize,
                order: mesh.order,
                damping: mesh.damping,
            },
            run,
            record,
            sizes,
        };
        let tension = LAYER_TENSION * parameters.impact.velocity;
        parameters.record.layer_tension =
            derived.layer_tension.unwrap_or_else(|| system.default(Dimension::Stress, tension));
        parameters.record.probes = derived.probes.unwrap_or_else(|| default_probes(&parameters, &system));
        parameters.record.r_max = derived.r_max.unwrap_or_else(|| parameters.default_r_max());
        parameters.record.field_every =
            derived.field_every.unwrap_or_else(|| parameters.default_field_every());
        Some(parameters)
    });
    let parameters = document.finish(parameters)?;
    Ok(Case { parameters, given, profile })
}

/// Default of `record.probes` \[R\]: of three digits in the unit in which the case is recorded.
fn default_probes(parameters: &Parameters, system: &System) -> Vec<f64> {
    let unit = system.scales().map_or(1.0, |scales| scales.of(Dimension::Length));
    let radius = parameters.likely_radius() * unit;
    let rounded = |share: f64| format!("{:.2e}", share * radius).parse::<f64>().expect("a number");
    let reduced =
        |length: f64| system.scales().map_or(length, |scales| scales.reduce(Dimension::Length, length));
    DEFAULT_PROBES.map(|share| reduced(rounded(share))).to_vec()
}

/// Most characters of a title.
const LONGEST_TITLE: usize = 1000;

fn read_title(root: &mut Section<'_>) -> Option<String> {
    let title = root.get::<String>("title", "a text in quotes")?;
    let length = title.value.chars().count();
    if length > LONGEST_TITLE {
        let allowed = format!("{LONGEST_TITLE} characters at most");
        return root.refuse("title", title.span, format!("`title` has {length} characters"), &allowed);
    }
    Some(title.value)
}

fn default_title(name: &str) -> String {
    Path::new(name).file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
}

struct GivenImpact {
    /// V0, or its default; `None` if it is missing or refused.
    velocity: Option<f64>,
    contact: Option<Given<Rule>>,
}

fn read_impact(mut section: Section<'_>, system: &System) -> GivenImpact {
    let bounds = Bounds::within(TINY, HUGE);
    let velocity = match system {
        System::Dimensionless | System::Unclear { .. } => {
            section.quantity("velocity", Dimension::Speed, bounds, system)
        }
        // c_p is no velocity that anybody means
        System::Physical { .. } => section.require_quantity("velocity", Dimension::Speed, bounds, system),
    };
    let is_default = matches!(system, System::Dimensionless) && !section.is_refused("velocity");
    let velocity = velocity.map(value).or(is_default.then_some(1.0));
    let contact = section.get("contact", "unilateral, bilateral, prescribed");
    section.end();
    GivenImpact { velocity, contact }
}

/// * `target`: a sound one
fn read_mesh(
    mut section: Section<'_>,
    model: ModelKind,
    target: Option<&Target>,
    system: &System,
) -> GivenMesh {
    let kind = read_mesh_kind(&mut section, model, target);
    let cells = section.count("cells", 2..=1_000_000);
    let outer_radius =
        section.quantity("outer_radius", Dimension::Length, Bounds::within(TINY, HUGE), system);
    let cells = cells.unwrap_or(Given { value: DEFAULT_CELLS, span: section.span() });
    let (order, damping) = match model {
        ModelKind::Rakhmatulin => read_scheme(&mut section, kind),
        ModelKind::Elastic => read_elastic_scheme(&mut section, target),
    };
    section.end();
    GivenMesh { kind, cells, outer_radius, order, damping }
}

/// Order and damping of the scheme, which the paper's mesh does not leave open.
fn read_scheme(section: &mut Section<'_>, kind: MeshKind) -> (Option<Order>, f64) {
    let order = section.get::<Order>("order", "4, 2");
    let damping = section.number("damping", Bounds::within(0.0, LARGEST_DAMPING));
    if kind == MeshKind::Matched {
        return (Some(order.map_or(Order::Fourth, value)), damping.map_or(DEFAULT_DAMPING, value));
    }
    let help = "leave the key out, or use mesh.kind = \"matched\"";
    if let Some(order) = order.filter(|order| order.value != Order::Second) {
        section.problem(order.span, "`mesh.order` = 4 needs the matched mesh; the paper's has order 2", help);
    }
    if let Some(damping) = damping.filter(|damping| damping.value != 0.0) {
        let message =
            format!("`mesh.damping` = {:?} needs the matched mesh; the paper's has none", damping.value);
        section.problem(damping.span, message, help);
    }
    (Some(Order::Second), 0.0)
}

/// Placement of nodes, which model `elastic` and layers do not leave open.
fn read_mesh_kind(section: &mut Section<'_>, model: ModelKind, target: Option<&Target>) -> MeshKind {
    let Some(Given { value, span }) = section.get("kind", "matched, paper") else { return MeshKind::Matched };
    if value == MeshKind::Paper && target.is_some_and(|target| !target.is_simple()) {
        let message = "`mesh.kind` = \"paper\" needs a target of one layer with a rigid back";
        section.problem(span, message, "leave the key out: layers and free backs have the matched mesh");
        return MeshKind::Matched;
    }
    if (model, value) == (ModelKind::Elastic, MeshKind::Paper) {
        let message = "`mesh.kind` = \"paper\" is not possible with model = \"elastic\"";
        section.problem(
            span,
            message,
            "leave the key out: the scheme of the full theory has the matched mesh",
        );
        return MeshKind::Matched;
    }
    value
}

/// Damping of the scheme with two displacements, which has one order.
///
/// * `target`: a sound one
fn read_elastic_scheme(section: &mut Section<'_>, target: Option<&Target>) -> (Option<Order>, f64) {
    if let Some(order) = section.get::<Order>("order", "no value with model = \"elastic\"") {
        let message = "`mesh.order` is not possible with model = \"elastic\"";
        section.problem(
            order.span,
            message,
            "leave the key out: the scheme of the full theory has one order",
        );
    }
    // one σ for all layers
    let ratio = target.map(Target::largest_ratio);
    let largest = ratio.map_or(elastic::LARGEST_DAMPING, elastic::largest_damping);
    let damping = section.number("damping", Bounds::within(0.0, elastic::LARGEST_DAMPING));
    if let Some(Given { value, span }) = damping.as_ref().filter(|damping| damping.value > largest) {
        let ratio = (1e4 * ratio.unwrap_or_default()).round() / 1e4;
        let message = format!("`mesh.damping` = {value:?} is not stable at c_s/c_p = {ratio}");
        // no number that is refused is offered
        let offered = (1e4 * largest).floor() / 1e4;
        section.problem(span.clone(), message, format!("allowed: {}", Bounds::within(0.0, offered)));
    }
    (None, damping.map_or(DEFAULT_LATERAL_DAMPING.min(largest), value))
}

fn read_run(mut section: Section<'_>, system: &System) -> (Run, Span) {
    let end_time = section.require_quantity("end_time", Dimension::Time, Bounds::above(0.0, 1e12), system);
    let stop = section.get("stop", "never, extension, separation").map_or(Stop::Never, value);
    let checkpoint_every = section.number("checkpoint_every", Bounds::within(0.0, 1e9)).map(value);
    let span = span_of(&end_time).unwrap_or(section.span());
    section.end();
    (Run { end_time: end_time.map_or(1.0, value), stop, checkpoint_every }, span)
}

/// Keys of `[record]`, if given, whose defaults depend on the sizes.
struct Derived {
    layer_tension: Option<f64>,
    probes: Option<Vec<f64>>,
    r_max: Option<f64>,
    field_every: Option<usize>,
}

/// The `[record]` section.
///
/// * `target`: if it is sound
fn read_record(
    mut section: Section<'_>,
    end_time: f64,
    model: ModelKind,
    target: Option<&Target>,
    system: &System,
) -> (Record, Derived) {
    let thickness = target.and_then(|target| target.thickness);
    let interface_every = section.count("interface_every", 1..=1_000_000_000).map_or(1, value);
    let radii = (Dimension::Length, Bounds::within(0.0, HUGE));
    let probes = section.quantities("probes", "radii", radii, system).map(value);
    let stress = Bounds::within(TINY, HUGE);
    let layer_tension = section.quantity("layer_tension", Dimension::Stress, stress, system);
    let has_interfaces = target.is_none_or(|target| target.layers.len() > 1);
    if let Some(Given { span, .. }) = layer_tension.as_ref().filter(|_| !has_interfaces) {
        let message = "`record.layer_tension` is of the interfaces of several layers, and the target has one";
        section.problem(span.clone(), message, "leave it out, or give target.layer");
    }
    let points = gauges::read_points(&mut section, thickness, system);
    let lines = gauges::read_lines(&mut section, thickness, system);
    let fields = read_fields(&mut section, model);
    let radius = Bounds::within(TINY, HUGE).or_infinite();
    let r_max = section.quantity("r_max", Dimension::Length, radius, system).map(value);
    let field_every = section.count("field_every", 1..=1_000_000).map(|given| given.value as usize);
    let views = read_names(&mut section, "views", "field, image, scene, fronts, tf, profile").map(value);
    let frames = read_frames(&mut section, end_time, system);
    let compression = section.get("compression", "none, lz4, zstd").map_or(Compression::Zstd, value);
    let playback_rate = section.number("playback_rate", Bounds::within(1e-9, 1e12));
    section.end();
    let playback_rate = playback_rate.map_or_else(|| default_playback_rate(end_time, system), value);
    let record = Record {
        interface_every,
        probes: Vec::new(),
        layer_tension: 0.0,
        points,
        lines,
        fields: fields.unwrap_or(vec![Field::Stress]),
        r_max: f64::INFINITY,
        field_every: 1,
        views: views.unwrap_or(ViewChannel::ALL.to_vec()),
        frames,
        compression,
        playback_rate,
    };
    (record, Derived { layer_tension: layer_tension.map(value), probes, r_max, field_every })
}

/// Seconds of log time per unit of time: 1, in a physical case the power of ten that plays the run in 2 to 20 s.
fn default_playback_rate(end_time: f64, system: &System) -> f64 {
    let Some(scales) = system.scales() else { return 1.0 };
    let seconds = end_time * scales.of(Dimension::Time);
    let powers = (-9..=12).map(|power| 10f64.powi(power));
    powers.into_iter().find(|rate| rate * seconds >= 2.0).unwrap_or(1e12)
}

/// The recorded fields, each one that the model has.
fn read_fields(section: &mut Section<'_>, model: ModelKind) -> Option<Vec<Field>> {
    let known = Field::ALL.into_iter().filter(|field| field.belongs_to(model));
    let known: Vec<&str> = known.map(Field::name).collect();
    let known = known.join(", ");
    let fields = read_names::<Field>(section, "fields", &known)?;
    if let Some(field) = fields.value.iter().find(|field| !field.belongs_to(model)) {
        let message =
            format!("`record.fields` names {:?}, which model = \"rakhmatulin\" does not have", field.name());
        let help = format!("allowed: {known}; model = \"elastic\" has them all");
        section.problem(fields.span.clone(), message, help);
    }
    Some(fields.value)
}

fn read_frames(section: &mut Section<'_>, end_time: f64, system: &System) -> Frames {
    let frames = section.count("frames", 0..=1_000_000);
    // a placeholder for the end time is no bound
    let bounds = Bounds::within(0.0, if section.document.is_sound() { end_time } else { 1e12 });
    let frame_times = section.quantities("frame_times", "times", (Dimension::Time, bounds), system);
    match (frames, frame_times) {
        (Some(_), Some(times)) => {
            let message = "`record.frames` and `record.frame_times` are both given";
            section.problem(times.span, message, "leave one of them out");
            Frames::At(Vec::new())
        }
        (None, Some(times)) => Frames::At(times.value),
        (frames, None) => Frames::Spread(frames.map_or(DEFAULT_FRAMES, value) as usize),
    }
}

/// A list of names, each at most once.
///
/// * `known`: all names
fn read_names<T: DeserializeOwned + PartialEq + fmt::Debug>(
    section: &mut Section<'_>,
    key: &'static str,
    known: &str,
) -> Option<Given<Vec<T>>> {
    let given = section.get::<Vec<T>>(key, &format!("a list of {known}"))?;
    let repeated = given.value.iter().enumerate().find(|(i, name)| given.value[..*i].contains(name));
    if let Some((_, name)) = repeated {
        let message = format!("`record.{key}` names {name:?} twice").to_lowercase();
        section.problem(given.span.clone(), message, "name each once");
    }
    Some(given)
}

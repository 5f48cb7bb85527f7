//! The keys of case files: one row each, from which they are read, checked, completed, written and documented.
//!
//! A new key is a row here and its use; what it means together with other keys is a rule beside its use.

use std::fmt::Write;

use Kind::{
    Choice, Count, Line, Material, Name, NameOr, Number, Pair, Preset, Quantity, Si, Table, Tables, Text,
    Thickness,
};
use Who::{Dimensionless, Physical, Shapes};

use super::numbers::{Bounds, HUGE, MAX_LIST, System, TINY};
use crate::{
    model::{Field, ModelKind, elastic, scheme},
    units::Dimension::{self, Density, Force, Frequency, Length, Mass, Speed, Stress, Time},
};

#[derive(Clone, Copy, Debug)]
pub(super) enum Kind {
    /// A text, of this kind.
    Text(&'static str),
    /// One of these names.
    Name(&'static [&'static str]),
    /// One of these names, or a table with the keys of this section.
    NameOr(&'static [&'static str], &'static Section),
    /// One of these whole numbers.
    Choice(&'static [i64]),
    /// A whole number from the first to the second one, in a unit.
    Count(i64, i64, &'static str),
    /// A number in a unit that is the same in all cases.
    Number(Bounds, &'static str),
    /// A number with a dimension: plain in dimensionless cases, a text with its unit in physical ones.
    Quantity(Dimension, Bounds),
    /// One of a material, which keeps its SI units.
    Si(Dimension, Bounds),
    /// A length, or `"half-space"`.
    Thickness,
    /// A list, with a word for its elements and their largest number; of names, each at most once.
    List { of: &'static Self, noun: &'static str, most: usize },
    /// Two values of these kinds.
    Pair(&'static [Self; 2]),
    /// A line in the target, `{ r = … }` or `{ z = … }`.
    Line,
    /// The name of a material, or the table of its constants.
    Material,
    /// A table with the keys of this section.
    Table(&'static Section),
    /// The name of a material.
    Preset,
    /// A list of tables with the keys of this section, with a word for them and their largest number.
    Tables(&'static Section, &'static str, usize),
}

/// What holds if a key is left out.
#[derive(Clone, Copy, Debug)]
pub(super) enum Absent {
    /// The case is refused.
    Required,
    /// This value, in TOML.
    Value(&'static str),
    /// What a rule makes of it, in words.
    Words(&'static str),
}

/// Cases that may have a key.
#[derive(Clone, Copy, Debug)]
pub(super) enum Who {
    All,
    Model(ModelKind),
    Dimensionless,
    Physical,
    /// Indenters of these shapes.
    Shapes(&'static [&'static str]),
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Key {
    pub name: &'static str,
    pub kind: Kind,
    pub absent: Absent,
    pub who: Who,
    /// Keys of the same section that leave no place for this one.
    pub not_beside: &'static [&'static str],
    meaning: &'static str,
}

const fn key(name: &'static str, kind: Kind, meaning: &'static str) -> Key {
    Key { name, kind, absent: Absent::Words("none"), who: Who::All, not_beside: &[], meaning }
}

const fn list(of: &'static Kind, noun: &'static str, most: usize) -> Kind {
    Kind::List { of, noun, most }
}

impl Key {
    const fn required(self) -> Self {
        Self { absent: Absent::Required, ..self }
    }

    const fn default(self, value: &'static str) -> Self {
        Self { absent: Absent::Value(value), ..self }
    }

    const fn left_out(self, words: &'static str) -> Self {
        Self { absent: Absent::Words(words), ..self }
    }

    const fn only(self, who: Who) -> Self {
        Self { who, ..self }
    }

    const fn not_beside(self, keys: &'static [&'static str]) -> Self {
        Self { not_beside: keys, ..self }
    }
}

/// A table of a case file.
#[derive(Debug)]
pub(super) struct Section {
    /// Its name; empty for the top level.
    pub path: &'static str,
    pub keys: &'static [Key],
}

impl Section {
    /// Names of its keys, each once.
    pub fn names(&self) -> Vec<&'static str> {
        let mut names: Vec<&str> = self.keys.iter().map(|key| key.name).collect();
        names.dedup();
        names
    }
}

/// A section, a row for each key: name, kind, what else is said of it ([`Key`]), and its meaning.
macro_rules! section {
    ($path:expr; $($name:ident: $kind:expr $(, $rule:ident($($argument:expr),*))* => $meaning:literal;)*) => {
        Section { path: $path, keys: &[$(key(stringify!($name), $kind, $meaning)$(.$rule($($argument),*))*),*] }
    };
}

/// Sizes that are not 0.
pub(super) const SIZE: Bounds = Bounds::within(TINY, HUGE);
const TIMES: Kind = Quantity(Time, Bounds::within(0.0, 1e12));
const FORCES: Kind = Quantity(Force, ANY);
/// Lengths that are not 0.
const EXTENT: Kind = Quantity(Length, SIZE);
pub(super) const LENGTH: Kind = Quantity(Length, Bounds::within(0.0, HUGE));
/// Depths, in an indenter that gives negative.
pub(super) const DEPTH: Kind = Quantity(Length, Bounds::within(-HUGE, HUGE));
/// SI values that scales are made of.
const POSITIVE: Bounds = Bounds::above(0.0, 1e30);
const MODULUS: Kind = Si(Stress, POSITIVE);
const STRENGTH: Bounds = Bounds::above(0.0, 1e30).or_infinite();
const ANY: Bounds = Bounds::within(-1e30, 1e30);
/// The unit of length \[m\]: scales that follow from it are far from overflow.
pub(super) const LENGTH_UNIT: Bounds = Bounds::within(1e-12, 1e9);
pub(super) const RELATIVE: Bounds = SIZE;
/// Keys of section `mesh` that only a graded mesh has.
pub(super) const GRADED: [&str; 5] =
    ["contact_cells", "grading", "near_radius", "near_depth", "largest_cell"];
const LAYERS: Kind = Tables(&LAYER, "layers", MAX_LAYERS);
pub(super) const MAX_LAYERS: usize = 100;

/// The section of a case without an indenter.
pub(super) const LOAD: &str = "load";
/// Keys of a force over time that is no pulse.
pub(super) const FORCE_ROWS: [&str; 3] = ["points", "table", "recording"];
/// Sections of a case with one.
pub(super) const OF_INDENTER: [&str; 2] = ["indenter", "impact"];
pub(super) const SHAPES: [&str; 5] = ["flat", "paraboloid", "sphere", "cone", "profile"];
const VIEWS: [&str; 6] = ["field", "image", "scene", "fronts", "tf", "profile"];
const RAKHMATULIN: Who = Who::Model(ModelKind::Rakhmatulin);
const ELASTIC: Who = Who::Model(ModelKind::Elastic);
const CONE: Who = Shapes(&["cone"]);
const SPHERE: Who = Shapes(&["sphere"]);
const PROFILE: Who = Shapes(&["profile"]);

pub(super) const ROOT: Section = section! { "";
    title: Text("a text in quotes"), left_out("name of the case") => "title of the run";
    model: Name(&ModelKind::NAMES), default("\"rakhmatulin\"") =>
        "simplified theory with one displacement, or linear elasticity in full";
    geometry: Name(&["axisymmetric", "plane"]), default("\"axisymmetric\"") =>
        "symmetry; the full theory has plane strain in the plane";
    length_unit: Quantity(Length, LENGTH_UNIT), only(Physical) =>
        "R, its range in m, if the indenter has neither `radius` nor `nose_radius`";
};

pub(super) const LAYER: Section = section! { "target.layer";
    thickness: Thickness, required() => "half-space in the last layer only";
    density: Number(RELATIVE, "γ"), default("1.0"), only(Dimensionless) => "density, 1 in the first layer";
    wave_speed: Number(RELATIVE, "c_p"), default("1.0"), only(Dimensionless) =>
        "longitudinal wave speed, 1 in the first layer";
    shear_wave_speed: Number(RELATIVE, "c_p"), left_out("that of the first layer"), not_beside(&["material"]) =>
        "c_s, in units of c_p of the first layer, where it makes the case dimensionless";
    bond: Name(&["welded", "sliding"]), default("\"welded\"") =>
        "to the layer above, from the second layer on; sliding passes no shear stress and needs `model = \"elastic\"`";
    bond_strength: Table(&BOND_STRENGTH), only(Physical) =>
        "of the bond to the layer above, `{ normal = …, shear = … }`, for measures: nothing breaks";
    material: Material, only(Physical) => "required in every layer";
};

pub(super) const BOND_STRENGTH: Section = section! { "target.layer.bond_strength";
    normal: Si(Stress, STRENGTH), required() => "tension across the interface";
    shear: Si(Stress, STRENGTH), required() => "shear stress along it";
};

pub(super) const BODY: Section = section! { "indenter.body";
    radius: EXTENT, left_out("that of the indenter") => "of the body, whose rim is held as the target's";
    layer: LAYERS, left_out("required") =>
        "layers from the nose up, with the keys of `target.layer`; the last may be a half-space, a long bar";
    back: Table(&BODY_BACK) => "what is bonded to the back: `[indenter.body.back]`";
};

/// What is bonded to its back.
pub(super) const BODY_BACK: Section = section! { "indenter.body.back";
    mass: Quantity(Mass, Bounds::within(TINY, 1e12)), required() =>
        "of a rigid body that is bonded to the back, a drop weight";
};

pub(super) const SENSOR: Section = section! { "record.sensor";
    r: LENGTH, required() => "radius of its middle";
    face: Name(&["front", "back"]), default("\"front\"") => "the struck face, or the far one, which has to be free";
    aperture: LENGTH, default("0.0") =>
        "radius of the disc, in the plane half the width of the strip, over which it takes the mean; 0 for a point";
    quantity: Name(&["displacement", "velocity"]), default("\"displacement\"") =>
        "of the face along z, positive along the blow";
    band: list(&Quantity(Frequency, SIZE), "frequencies", 2) =>
        "the lower and the upper corner of a band-pass, whose output is recorded beside the value: Butterworth, of second order at either \
         corner, forward and backward, so that no phase is shifted, with half the amplitude at the corners";
};

pub(super) const MATERIAL: Section = section! { "target.material";
    youngs_modulus: MODULUS => "E, one of two";
    poisson_ratio: Number(Bounds::between(-1.0, 0.5), "1") => "ν, one of two";
    bulk_modulus: MODULUS => "K, one of two";
    shear_modulus: MODULUS => "G, one of two";
    wave_speed: Si(Speed, POSITIVE) => "c_p, one of two";
    shear_wave_speed: Si(Speed, POSITIVE) => "c_s, one of two";
    C11: MODULUS => "stiffness along r of a material whose axis of symmetry is z, with the four below; `elastic` only";
    C33: MODULUS => "stiffness along z";
    C13: Si(Stress, ANY) => "stress along z by strain along r";
    C44: MODULUS => "shear modulus in the r–z plane";
    C66: MODULUS => "shear modulus in the plane of the layer";
    E_r: MODULUS => "Young's modulus along r of such a material, with the four below, in place of the stiffness";
    E_z: MODULUS => "Young's modulus along z";
    nu_rt: Number(Bounds::between(-1.0, 1.0), "1") => "Poisson's ratio in the plane of the layer";
    nu_zr: Number(Bounds::between(-10.0, 10.0), "1") =>
        "strain along r under stress along z, over that along z, with the other sign";
    G_rz: MODULUS => "shear modulus in the r–z plane";
    density: Si(Density, POSITIVE), required() => "density";
    yield_strength: MODULUS, left_out("none; of a name that of its grade, in `percuss materials`") =>
        "for measures and estimates, as those below: the theory is linear, nothing yields";
    tensile_strength: MODULUS, left_out("likewise") => "tension at break";
    compressive_strength: MODULUS, left_out("likewise") => "compression at break";
};

pub(super) const FORCE: Section = section! { "load.force";
    pulse: Name(&["hertz", "cosine", "ricker", "step"]), left_out("required, or one of the three below") =>
        "of peak F and duration T: F·sin^{3/2}(πt/T), F/2·(1 − cos 2πt/T), Ricker's of middle frequency 3/T; or a step";
    points: list(&Pair(&[TIMES, FORCES]), "points", MAX_LIST), not_beside(&["pulse"]) =>
        "pairs `[time, force]`, linear between them, 0 before the first and after the last";
    table: Text("the path of a CSV file with columns t, F"), not_beside(&["pulse", "points"]) =>
        "the same from a file; physical: `t [us],F [N]` in the heading";
    recording: Text("the path of a recording"), not_beside(&["pulse", "points", "table"]), only(Physical) =>
        "the same from `/drag` of a recording";
    peak: FORCES, left_out("required by a pulse") => "F";
    duration: TIMES, left_out("required by a pulse") => "T";
    rise: TIMES, left_out("required by a step") => "of a step, like half a cosine; 0 for a jump";
};

/// The sections below the top level, in the order in which they are read and written.
pub(super) static SECTIONS: [Section; 7] = [
    section! { "target";
        thickness: Thickness, required(), not_beside(&["layer"]) => "thickness h";
        shear_wave_speed: Number(Bounds::between(0.0, 1.0), "c_p"), left_out("required, or `material`"), not_beside(&["layer", "material"]) =>
            "c_s/c_p, in the full theory below √3/2: the case is dimensionless";
        material: Material, left_out("required, or `shear_wave_speed`"), not_beside(&["layer"]) =>
            "the case is physical; names: `percuss materials`; table: `[target.material]`";
        back: Name(&["rigid", "free"]), default("\"rigid\"") =>
            "far side of the last layer, rigid and smooth or free; not with a half-space. Above a free back the last row of nodes lies half a \
             row of cells inside: `u` there is that of the face";
        radius: EXTENT, left_out("none: the target has no end along r"), only(ELASTIC) =>
            "of a disc or a bar, in the plane half the width of a plate";
        rim: Name(&["free", "guided"]), default("\"free\""), only(ELASTIC) =>
            "what holds the rim of a target with a `radius`: nothing, or a smooth guide that lets it slide along z";
        layer: LAYERS => "layers, from the struck surface down, 100 at most";
    },
    section! { "indenter";
        shape: Name(&SHAPES), required() => "shape of the head, f(r)";
        radius: EXTENT, left_out("unbounded; sphere: whole; profile: last point") =>
            "radius of the body; required by flat; at most `nose_radius` of a sphere";
        diameter: EXTENT, only(SPHERE), not_beside(&["nose_radius"]) =>
            "2ρ, in place of `nose_radius`; in `--set` and `--vary` either takes the place of the other";
        diameter: EXTENT, only(Shapes(&["flat", "paraboloid", "cone", "profile"])), not_beside(&["radius"]) =>
            "of the body, in place of `radius`; likewise";
        edge_radius: LENGTH, default("0.0"), only(Shapes(&["flat"])) =>
            "radius e of the corner, f = e − √(e² − (r − R + e)²)";
        nose_radius: EXTENT, left_out("required"), only(Shapes(&["paraboloid", "sphere"])) =>
            "ρ of f = r²/(2ρ), and of f = ρ − √(ρ² − r²)";
        slope: Number(SIZE, "1"), left_out("required, or `half_angle`"), only(CONE), not_beside(&["half_angle"]) => "df/dr";
        half_angle: Number(Bounds::between(0.0, 90.0), "degrees"), only(CONE) => "angle from the axis, in place of `slope`";
        file: Text("the path of a CSV file with columns r, f"), left_out("required, or `points`"), only(PROFILE), not_beside(&["points"]) =>
            "columns r, f, the tip 0, 0 first; physical: `r [mm],f [mm]` in the heading";
        points: list(&Pair(&[LENGTH, LENGTH]), "points", MAX_LIST), only(PROFILE) =>
            "pairs `[r, f]`, the tip 0, 0 first, in place of `file`";
        mass: Quantity(Mass, Bounds::within(TINY, 1e12).or_infinite()), default("inf"), not_beside(&["density", "length"]) =>
            "with finite mass the body slows down and rebounds; infinite with prescribed contact";
        density: Quantity(Density, SIZE), not_beside(&["material"]) =>
            "gives a whole sphere, or a body with a `length`, its mass, instead of `mass` or `material`";
        material: Preset, only(Physical) =>
            "instead of `density`, unless `mass` is given, and says how rigid the indenter is; names: `percuss materials`";
        body: NameOr(&["rigid", "elastic"], &BODY), left_out("rigid"), only(ELASTIC) =>
            "elastic: the body gives, a cylinder of the indenter's material and radius, as long as its mass asks, with the head as the gap \
             over its face; or the table `[indenter.body]`";
        length: EXTENT =>
            "at least that of the head: from the tip to the flat end of a body with a `radius`; gives it a mass by `density` or `material`";
    },
    section! { "impact";
        velocity: Quantity(Speed, SIZE), default("1.0"), only(Dimensionless) => "V0";
        // a physical case must state V0: c_p is no sensible default
        velocity: Quantity(Speed, SIZE), left_out("required, or `drop`"), only(Physical), not_beside(&["drop"]) => "V0";
        drop: Quantity(Length, Bounds::within(TINY * TINY, HUGE * HUGE)), only(Physical) =>
            "height h of a fall, V0 = √(2gh) with g = 9.80665 m/s², in place of `velocity`; in `--set` and `--vary` either takes the place of \
             the other";
        contact: Name(&["unilateral", "bilateral", "prescribed"]), default("\"unilateral\"") =>
            "bilateral is glued, for a flat face with a sharp edge; prescribed gives the motion of the surface";
    },
    section! { LOAD;
        radius: EXTENT, left_out("the load is on a point, one cell of the mesh") =>
            "of the disc that is loaded, in the plane half the width of a strip";
        distribution: Name(&["uniform", "hertz"]), default("\"uniform\"") => "of the pressure; hertz: √(1 − r²/a²)";
        force: Table(&FORCE), required() => "`[load.force]`";
    },
    section! { "mesh";
        kind: Name(&["matched", "paper"]), default("\"matched\"") =>
            "paper: r_i = i·Δr, Δr = Δz; for the simplified theory on one layer with a rigid back";
        cells: Count(2, 1_000_000, "1"), left_out("100, or by `contact_cells`"), not_beside(&["contact_cells"]) =>
            "nodes across the radius or unit length, all cells alike; on the paper's mesh 1/Δz";
        contact_cells: Count(8, 10_000, "1"), left_out("20 for a physical case without `cells` whose head spreads its contact"), only(ELASTIC) =>
            "cells across the diameter of the largest contact, which Hertz estimates, under a flat punch across the punch; the mesh is graded: \
             beyond the contact cells grow. In `--set` and `--vary` it takes the place of `cells`, and `cells` that of it";
        grading: Number(Bounds::within(1.0, 2.0), "1"), left_out("1.05"), only(ELASTIC) =>
            "of a graded mesh: ratio of neighbouring cells beyond the near zone; 1 for none";
        near_radius: EXTENT, left_out("1.5 of the largest contact radius"), only(ELASTIC) =>
            "of a graded mesh: cells are alike out to here";
        near_depth: EXTENT, left_out("1.5 of the largest contact radius"), only(ELASTIC) =>
            "of a graded mesh: cells are alike down to here";
        largest_cell: Quantity(Length, SIZE.or_infinite()), left_out("inf; along z c_s/40 of the time of contact by Hertz"), only(ELASTIC) =>
            "of a graded mesh: cells grow no further";
        order: Choice(&[4, 2]), default("4"), only(RAKHMATULIN) => "order of accuracy for oblique waves; the paper's mesh has 2";
        damping: Number(Bounds::within(0.0, scheme::LARGEST_DAMPING), "1"), default("1.0"), only(RAKHMATULIN) =>
            "of oblique waves that the mesh does not resolve; the paper's mesh has none";
        damping: Number(Bounds::within(0.0, elastic::LARGEST_DAMPING), "1"), left_out("0.5, less where that is not stable"), only(ELASTIC) =>
            "of waves along r that the mesh does not resolve, which moving edges of contact excite. It is 0 for fronts along z and falls with \
             the fifth power of the wave number; above c_s/c_p = 0.82 less of it is stable. 0.8 halves what noise is left over soft targets \
             (c_s/c_p ≤ 0.3); surface waves of few nodes are best computed without";
        outer_radius: EXTENT, left_out("derived") => "beyond the reach of waves; a contact that gets there is an error, waves that come back from there before the end are warned of";
    },
    section! { "run";
        end_time: Quantity(Time, Bounds::above(0.0, 1e12)), required() =>
            "time at the last step, but for rounding to whole steps";
        stop: Name(&["never", "extension", "separation"]), default("\"never\"") =>
            "ends the run earlier: where the interface needs tension (under a rounded head: once the contact is seen to have turned back), or \
             when the indenter has left (V ≤ 0, no contact for Δr/c_s)";
        bounces: Count(1, 1000, "1"), left_out("1"), only(Physical) =>
            "number of impacts of a whole sphere that `percuss run` computes one after the other, each with the velocity of the rebound \
             before; needs `stop` = \"separation\"";
        checkpoint_every: Number(Bounds::within(0.0, 1e9), "s"), left_out("600") =>
            "wall time from one checkpoint to the next, 0 for none; `percuss run --resume` continues from them";
    },
    section! { "record";
        interface_every: Count(1, 1_000_000_000, "steps"), default("1") =>
            "steps between messages of interface stress and lines; the last step has one too";
        probes: list(&LENGTH, "radii", MAX_LIST), left_out("derived") =>
            "radii at which `/probes` has the interface stress, in every step; by default 0, 0.5, 0.9, 0.95 and 0.99 of the largest contact \
             radius, estimated from V0·`end_time`, of a ball of finite mass from Hertz";
        layer_tension: Quantity(Stress, SIZE), left_out("derived") =>
            "of targets and indenters of layers: tension of an interface from which on it is an event, `LAYER_TENSION`; by default a hundredth \
             of Z·V0 of the struck layer. The largest tension and shear of every interface are recorded whatever it is";
        points: list(&Pair(&[LENGTH, DEPTH]), "points", 10_000) =>
            "`[r, z]`: displacement, velocity and stress on `/points`, in every step; z < 0 is in an indenter that gives";
        lines: list(&Line, "lines", 100) => "stress along them, on `/line/0`, …";
        sensor: Tables(&SENSOR, "sensors", 100) =>
            "sensors on the faces, 100 at most: mean displacement or velocity over a disc, on `/sensor/0`, …, in every step";
        fields: list(&Name(&Field::NAMES), "fields", MAX_LIST), default("[\"stress\"]") =>
            "recorded in frames; the simplified theory has the first three. Stresses are compressive positive, `stress` is −σ_zz, `pressure` \
             the mean of the normal ones; `damage_ratio`, of layers with a strength that is known, the largest ratio of a stress to it: of von \
             Mises to yield_strength, of the first principal one to tensile_strength";
        r_max: Quantity(Length, SIZE.or_infinite()), left_out("derived") =>
            "fields, pictures and lines along r reach to this radius, inf: to that of the mesh; by default to the largest contact radius and \
             as much again beside it, or three thicknesses if that is more: what the back and the surface return to the contact is inside. A \
             half-space is shown whole. No number changes by it";
        field_every: Count(1, 1_000_000, "nodes"), left_out("derived") =>
            "fields have every so many nodes along r and z; by default so that the moved part of a field stays within 16 MiB in all frames \
             together, but keeps 50 of the `cells`";
        views: list(&Name(&VIEWS), "views", MAX_LIST), default("[\"field\", \"image\", \"scene\", \"fronts\", \"tf\", \"profile\"]") =>
            "channels for viewers; `[]` for none";
        frames: Count(0, 1_000_000, "1"), default("200"), not_beside(&["frame_times"]) =>
            "number of frames, which show fields, energy and views, spread evenly over the run";
        frame_times: list(&TIMES, "times", MAX_LIST) =>
            "frames at the steps nearest to these times and at the last one, in place of `frames`";
        compression: Name(&["none", "lz4", "zstd"]), default("\"zstd\"") => "of the recording";
        playback_rate: Number(Bounds::within(1e-9, 1e12), "s"), left_out("1; physical: a power of ten that plays 2 to 20 s") =>
            "seconds of log time per unit of time, in physical cases per second";
    },
];

impl Who {
    /// Cases that may have the key, as the guide names them.
    fn words(&self) -> String {
        match self {
            Self::All => String::new(),
            Self::Model(model) => format!("`{}`: ", model.name()),
            Self::Dimensionless => "dimensionless cases: ".into(),
            Self::Physical => "physical cases: ".into(),
            Self::Shapes(shapes) => format!("{}: ", shapes.join(", ")),
        }
    }
}

impl Kind {
    /// Dimension of its numbers.
    pub fn dimension(&self) -> Option<Dimension> {
        match self {
            Self::Quantity(dimension, _) | Self::Si(dimension, _) => Some(*dimension),
            Self::Thickness | Self::Line => Some(Length),
            Self::List { of, .. } => of.dimension(),
            _ => None,
        }
    }

    /// The system of its numbers.
    pub fn system(&self, case: System) -> System {
        if let Self::Si(..) = self { System::SI } else { case }
    }

    /// What can be written, for messages.
    pub fn allowed(&self, system: &System) -> String {
        match self {
            Self::Text(what) => (*what).into(),
            Self::Name(names) | Self::NameOr(names, _) => names.join(", "),
            Self::Choice(numbers) => numbers.iter().map(i64::to_string).collect::<Vec<_>>().join(", "),
            Self::Count(low, high, _) => format!("a whole number from {low} to {high}"),
            Self::Number(bounds, _) => bounds.to_string(),
            Self::Quantity(dimension, bounds) | Self::Si(dimension, bounds) => {
                system.allowed(*dimension, *bounds)
            }
            Self::Thickness => format!("{}, or \"half-space\"", system.allowed(Length, SIZE)),
            Self::List { of: Self::Name(names), .. } => format!("a list of {}", names.join(", ")),
            Self::List { of, noun, .. } => format!("a list of {noun}, each {}", of.allowed(system)),
            Self::Pair([first, second]) => {
                format!("a pair of {}, and {}", first.allowed(system), second.allowed(system))
            }
            Self::Line => "{ r = a radius } along z or { z = a depth } along r".into(),
            Self::Material => "the name of a material, or a table of constants".into(),
            Self::Table(section) => {
                let keys: Vec<String> = section.names().iter().map(|name| format!("{name} = …")).collect();
                format!("a table, {{ {} }}", keys.join(", "))
            }
            Self::Preset => "the name of a material".into(),
            Self::Tables(..) => "a list of tables".into(),
        }
    }

    fn unit(&self) -> String {
        match self {
            Self::Count(_, _, unit) | Self::Number(_, unit) => (*unit).into(),
            _ => self.dimension().map_or(String::new(), |dimension| format!("{dimension:?}").to_lowercase()),
        }
    }
}

/// The table of a section as the guide has it.
///
/// * `heading`: of the section, `target.layer`
pub fn guide(heading: &str) -> Option<String> {
    let others = [&ROOT, &LAYER, &BOND_STRENGTH, &MATERIAL, &BODY, &BODY_BACK, &FORCE, &SENSOR];
    let mut sections = SECTIONS.iter().chain(others);
    let section = sections.find(|section| section.path == heading)?;
    let mut text =
        "| Key | Unit | Range | Default | Meaning, and who may have it |\n|---|---|---|---|---|\n".to_owned();
    for key in section.keys {
        let (unit, range) = (key.kind.unit(), key.kind.allowed(&System::PLAIN));
        let absent = match key.absent {
            Absent::Required => "required".into(),
            Absent::Value(value) => format!("`{value}`"),
            Absent::Words(words) => words.into(),
        };
        let (name, who, meaning) = (key.name, key.who.words(), key.meaning);
        writeln!(text, "| `{name}` | {unit} | {range} | {absent} | {who}{meaning} |")
            .expect("a String grows");
    }
    Some(text)
}

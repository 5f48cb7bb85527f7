//! Golden digests of the recorded messages of eight small cases: they show every change of results.
//!
//! Every case has a text `tests/golden/<case>.txt`, which begins with its purpose. Each computed channel has a line with its
//! topic, the number of its messages and a hash of them, and after it a few of its numbers at the middle and the last message:
//! in full digits, and as bits. The hash shows that results have changed, the numbers how.
//!
//! All of it is the same on every machine and for any number of threads. `tests/golden/numerics.txt` has the revision of the
//! numerics, [`NUMERICS`], with a hash of all digests. An intended change raises the revision, is blessed with
//!
//! ```text
//! PERCUSS_BLESS=1 cargo test golden
//! ```
//!
//! and committed by itself, with the reason for the new numbers. Other digests of a revision that has some are refused; one
//! that has never left its branch is blessed anew without the file `numerics.txt`.

use std::{collections::BTreeMap, fmt::Write, fs, path::Path};

use mcap::MessageStream;
use percuss::{
    advice::Advised,
    case::Case,
    message::percuss::{Drag, Energy, Event, FieldSlice, InterfaceStress, Probes, Velocity},
    recording::{Destination, NUMERICS},
    session::{self, Recording, Source},
    simulation::Simulation,
};
use prost::Message;

/// The case of a golden text.
struct Golden {
    name: &'static str,
    about: &'static str,
    built_in: &'static str,
    settings: &'static [&'static str],
}

/// All fields of all of the mesh, in few frames.
const SHARED: [&str; 3] =
    ["record.fields=[\"displacement\", \"velocity\", \"stress\"]", "record.frames=9", "record.r_max=inf"];

const CASES: [Golden; 8] = [
    Golden {
        name: "layers",
        about: "paraboloid on two layers: rows of two distances, reflections from the interface and a free back",
        built_in: "layers",
        settings: &["mesh.cells=20", "run.end_time=3.0", "target.back=\"free\""],
    },
    Golden {
        name: "laminate",
        about: "steel ball on alumina, epoxy, aluminium in the full theory: energies of layers, tension of interfaces",
        built_in: "laminate-armour",
        settings: &["mesh.cells=12", "record.points=[]", "record.lines=[]", "run.stop=\"never\""],
    },
    Golden {
        name: "layer",
        about: "flat punch of infinite mass on a layer: fronts and their reflections from the backing",
        built_in: "fig5",
        settings: &["mesh.cells=12", "run.end_time=3.5"],
    },
    Golden {
        name: "plane",
        about: "the same in plane geometry, with a mass",
        built_in: "fig5-plane",
        settings: &["mesh.cells=12", "run.end_time=3.5", "indenter.mass=2.0"],
    },
    Golden {
        name: "cone-mass",
        about: "cone with a mass and unilateral contact on a layer: contact that grows, rebound",
        built_in: "fig7a",
        settings: &[
            "mesh.cells=12",
            "run.end_time=5.0",
            "impact.contact=\"unilateral\"",
            "impact.velocity=0.4",
            "indenter.slope=0.2",
            "indenter.mass=0.4",
        ],
    },
    Golden {
        name: "paraboloid-half-space",
        about: "paraboloid with a mass and unilateral contact on a half-space that is seen through its surface only",
        built_in: "fig2-prescribed",
        settings: &[
            "mesh.cells=16",
            "run.end_time=3.0",
            "target.thickness=\"half-space\"",
            "impact.contact=\"unilateral\"",
            "indenter.mass=0.5",
            "record.frames=0",
        ],
    },
    Golden {
        name: "cone-prescribed",
        about: "cone whose contact is prescribed, on a half-space with fields",
        built_in: "fig6a",
        settings: &["mesh.cells=10", "run.end_time=2.0"],
    },
    Golden {
        name: "paper-bilateral",
        about: "glued flat punch on the mesh of the paper, whose radial Courant number is not 1",
        built_in: "fig5",
        settings: &[
            "mesh.kind=\"paper\"",
            "mesh.cells=10",
            "run.end_time=4.0",
            "impact.contact=\"bilateral\"",
        ],
    },
];

/// Numbers of a message that its digest shows, with their names.
type Numbers = Vec<(String, f64)>;

/// The numbers of a message: `None` for topics derived from the others, and for text.
fn numbers(topic: &str, bytes: &[u8]) -> Option<Numbers> {
    let named =
        |pairs: &[(&str, f64)]| pairs.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
    let array = |name: &str, values: &[f64]| {
        values.iter().enumerate().map(|(i, value)| (format!("{name}[{i}]"), *value)).collect()
    };
    fn decoded<M: Message + Default>(bytes: &[u8]) -> M {
        M::decode(bytes).expect("a message of its type")
    }
    Some(match topic {
        "/drag" => {
            let m: Drag = decoded(bytes);
            named(&[("force", m.force), ("contact_radius", m.contact_radius)])
        }
        "/velocity" => {
            let m: Velocity = decoded(bytes);
            named(&[("velocity", m.velocity), ("displacement", m.displacement)])
        }
        "/energy" => {
            let m: Energy = decoded(bytes);
            let whole = named(&[
                ("kinetic", m.kinetic),
                ("strain", m.strain),
                ("indenter", m.indenter),
                ("dissipated", m.dissipated),
                ("work", m.work),
                ("residual", m.residual.unwrap_or_default()),
            ]);
            let layers = [array("layer_strain", &m.layer_strain), array("layer_kinetic", &m.layer_kinetic)];
            [whole, layers.concat()].concat()
        }
        "/event" => {
            let m: Event = decoded(bytes);
            named(&[("step", m.step as f64), ("kind", f64::from(m.kind)), ("r", m.r.unwrap_or_default())])
        }
        "/probes" => array("stress", &decoded::<Probes>(bytes).stress),
        "/interface/stress" => array("stress", &decoded::<InterfaceStress>(bytes).stress),
        _ if topic.starts_with("/field/") => {
            let values: Vec<f64> = decoded::<FieldSlice>(bytes).values.into_iter().map(f64::from).collect();
            array("values", &values)
        }
        _ => return None,
    })
}

/// FNV-1a, 64 bits.
fn hash(state: u64, bytes: &[u8]) -> u64 {
    bytes.iter().fold(state, |state, byte| (state ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3))
}

/// Hash of nothing.
const EMPTY: u64 = 0xcbf2_9ce4_8422_2325;

/// Numbers shown of a message: the first, and others spread over it.
const SHOWN: usize = 3;

/// The digest of a recording.
fn digest(golden: &Golden, file: &[u8]) -> String {
    let mut channels: BTreeMap<String, (u64, Vec<(f64, Numbers)>)> = BTreeMap::new();
    for message in MessageStream::new(file).expect("a sound file") {
        let message = message.expect("a sound message");
        let topic = &message.channel.topic;
        if let Some(numbers) = numbers(topic, &message.data) {
            let (state, all) = channels.entry(topic.clone()).or_insert((EMPTY, Vec::new()));
            // times and numbers, not the bytes: results, independent of their encoding
            *state = hash(*state, &message.log_time.to_le_bytes());
            for (_, value) in &numbers {
                *state = hash(*state, &value.to_bits().to_le_bytes());
            }
            all.push((message.log_time as f64 / 1e9, numbers));
        }
    }
    let mut text = format!("# {}\n# {}", golden.about, golden.built_in);
    for setting in golden.settings {
        write!(text, " --set '{setting}'").expect("a String grows");
    }
    text.push('\n');
    for (topic, (state, messages)) in channels {
        writeln!(text, "\n{topic}  {} messages  {state:016x}", messages.len()).expect("a String grows");
        let mut shown = vec![messages.len() / 2, messages.len() - 1];
        shown.dedup();
        for (time, numbers) in shown.into_iter().map(|index| &messages[index]) {
            let every = numbers.len().div_ceil(SHOWN).max(1);
            // of records all numbers, of arrays some
            let every = if topic == "/energy" { 1 } else { every };
            for (name, value) in numbers.iter().step_by(every) {
                writeln!(text, "  t = {time:<12} {name:<14} {value:<24?} {:016x}", value.to_bits())
                    .expect("a String grows");
            }
        }
    }
    text
}

/// Records a case on so many threads.
fn record(golden: &Golden, threads: usize) -> Vec<u8> {
    let settings: Vec<String> = SHARED.iter().chain(golden.settings).map(|text| (*text).to_owned()).collect();
    let case = Case::load(golden.built_in, &settings).unwrap_or_else(|errors| panic!("{errors:?}"));
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("run.mcap");
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    pool.install(|| {
        let mut recording =
            Recording::create(&Destination::new(&path), &case, Source::Simulation).expect("a new file");
        let mut steps = Advised::new(&case, Simulation::new(&case));
        session::run(&mut steps, &mut [&mut recording]).expect("a sound case");
    });
    fs::read(&path).expect("the recording")
}

/// The first lines that differ, side by side.
fn difference(expected: &str, found: &str) -> String {
    let mut lines = found.lines();
    let mut text = String::new();
    for line in expected.lines().map(Some).chain(std::iter::repeat(None)) {
        match (line, lines.next()) {
            (None, None) => break,
            (expected, found) if expected == found => {}
            (expected, found) => {
                for (sign, line) in [('-', expected), ('+', found)] {
                    if let Some(line) = line {
                        writeln!(text, "{sign} {line}").expect("a String grows");
                    }
                }
            }
        }
    }
    text
}

/// The revision of the numerics, with a hash of all digests.
fn revision(number: u32, texts: &[String]) -> String {
    let digests = texts.iter().flat_map(|text| text.lines()).filter(|line| line.starts_with('/'));
    let hash = digests.fold(EMPTY, |state, line| hash(state, line.as_bytes()));
    format!("revision {number}  {hash:016x}\n")
}

/// True if a revision may take the place of another: the same digests, or another number.
fn may_follow(before: &str, after: &str) -> bool {
    before == after || before.split("  ").next() != after.split("  ").next()
}

#[test]
fn results_are_those_of_the_golden_digests() {
    let path =
        |name| Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(name).with_extension("txt");
    let texts = CASES.each_ref().map(|golden| {
        let text = digest(golden, &record(golden, 1));
        assert_eq!(text, digest(golden, &record(golden, 3)), "{}: threads make a difference", golden.name);
        text
    });
    let expected = |name| fs::read_to_string(path(name)).unwrap_or_default();
    let numerics = revision(NUMERICS, &texts);
    let is_revised = may_follow(&expected("numerics"), &numerics);
    let found = CASES.iter().map(|golden| golden.name).zip(texts).chain([("numerics", numerics)]);
    if std::env::var_os("PERCUSS_BLESS").is_some() {
        assert!(
            is_revised,
            "revision {NUMERICS} of the numerics has other digests: raise `NUMERICS` in src/recording.rs, say there why, and bless again"
        );
        found.for_each(|(name, text)| fs::write(path(name), text).expect("the golden text is written"));
        return;
    }
    let mut changed = String::new();
    for (name, text) in found {
        let difference = difference(&expected(name), &text);
        if !difference.is_empty() {
            write!(changed, "{}:\n{difference}", path(name).display()).expect("a String grows");
        }
    }
    assert!(
        changed.is_empty(),
        "results have changed; if that is intended, raise `NUMERICS` in src/recording.rs and PERCUSS_BLESS=1 cargo test golden\n{changed}"
    );
}

#[test]
fn other_digests_need_another_revision() {
    let texts =
        ["# a case\n\n/drag  7 messages  01\n  t = 1\n", "# b\n/drag  7 messages  02\n"].map(String::from);
    let mut others = texts.clone();
    let first = revision(1, &texts);
    others[1] = others[1].replace("02", "03");
    let changed = revision(1, &others);
    assert!(first != changed && !may_follow(&first, &changed), "{first} {changed}");
    assert!(may_follow(&first, &revision(2, &others)) && may_follow("", &changed));
    // what is said beside the digests is none
    others[1] = texts[1].replace("# b", "# c");
    assert_eq!(revision(1, &others), first);
}

#[test]
fn the_least_change_of_a_number_is_a_change_of_the_digest() {
    let golden = &CASES[0];
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/layer.txt");
    let expected = fs::read_to_string(path).expect("the golden text");
    let least = Golden {
        settings: &["mesh.cells=12", "run.end_time=3.5", "impact.velocity=1.0000000000000002"],
        ..*golden
    };
    let text = digest(golden, &record(&least, 1));
    let difference = difference(&expected, &text);
    // the hash of every channel that scales with the velocity
    for topic in ["/drag", "/energy", "/interface/stress", "/probes", "/velocity"] {
        assert!(difference.contains(&format!("+ {topic}  ")), "{topic}: {difference}");
    }
}

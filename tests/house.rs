//! Dependencies between modules: which may use which, and no circles.
//!
//! What a file uses is read from its text: paths that begin with `crate`, `super`, `self` or the name of a child, outside of comments
//! and tests.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

/// Modules of the library from the bottom up. Those of a line use modules of the lines before, not of their own or a later one.
const LAYERS: [&[&str]; 12] = [
    // names, limits, streams of bytes
    &["geometry", "input", "message", "recording", "state", "table", "validity"],
    &["grid", "indenter", "surface", "units"],
    &["material", "shape"],
    // target model: schemes and the private engine
    &["model"],
    &["contact"],
    &["case", "view"],
    &["channels", "exact", "measuring", "simulation"],
    &["layout"],
    // the loop over steps
    &["session"],
    &["advice", "checkpoint", "live"],
    // the program
    &["study", "sweep"],
    &["fit"],
];

/// A file that must not use another one, and all below it; with the reason.
const NEVER: [(&str, &str, &str); 4] = [
    ("model/blocked", "model/elastic", "the engine has weights and knows no theory"),
    ("model/blocked", "model/rakhmatulin", "the engine has weights and knows no theory"),
    ("model/scheme", "model/blocked", "the numerics are tested against the engine, not made of it"),
    ("model/reference", "model/blocked", "the plain stepper is what the engine is tested against"),
];

/// A module by its path, `["model", "blocked"]`; the crate itself is empty.
type Module = Vec<String>;

/// Modules that each module of a crate uses.
type Uses = BTreeMap<Module, BTreeSet<Module>>;

/// Reads all modules below a folder `src`.
fn read(source: &Path) -> Uses {
    let mut texts = BTreeMap::new();
    let mut folders = vec![source.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            let name = path.file_stem().and_then(|name| name.to_str()).expect("a name").to_owned();
            if path.is_dir() {
                folders.push(path);
            } else if !["lib", "main", "build", "tests", "models"].contains(&name.as_str()) {
                let module = path.strip_prefix(source).expect("a file below it").with_extension("");
                let module: Module = module.iter().map(|name| name.to_string_lossy().into_owned()).collect();
                if !module.contains(&"tests".to_owned()) {
                    texts.insert(module, code(&fs::read_to_string(&path).expect("a text")));
                }
            }
        }
    }
    let modules: BTreeSet<Module> = texts.keys().cloned().collect();
    let uses = texts.iter().map(|(module, text)| {
        let found = paths(text).into_iter().filter_map(|path| resolve(&path, module, &modules));
        (module.clone(), found.filter(|used| used != module && !used.is_empty()).collect())
    });
    uses.collect()
}

/// A text without comments and without the tests at its end.
fn code(text: &str) -> String {
    let text = text.split("#[cfg(test)]\nmod ").next().unwrap_or_default();
    let lines = text.lines().map(|line| line.split("//").next().unwrap_or_default());
    lines.collect::<Vec<_>>().join("\n")
}

/// All paths of two and more segments; trees of `use` are taken apart.
fn paths(code: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut rest = code;
    while let Some(start) = rest.find(|c: char| c.is_ascii_lowercase()) {
        let is_word = |c: char| c.is_alphanumeric() || c == '_';
        let end = rest[start..].find(|c| !is_word(c) && c != ':').map_or(rest.len(), |end| start + end);
        let path = &rest[start..end];
        rest = &rest[end..];
        if path.ends_with("::") && rest.starts_with('{') {
            let (tree, after) = rest.split_at(closing(rest));
            found.extend(branches(tree).iter().map(|branch| format!("{path}{branch}")));
            rest = after;
        } else if path.contains("::") {
            found.push(path.to_owned());
        }
    }
    found
}

/// Length of a text in braces at the beginning.
fn closing(text: &str) -> usize {
    let mut depth = 0;
    let end = text.find(|c| {
        depth += i32::from(c == '{') - i32::from(c == '}');
        depth == 0
    });
    end.expect("braces in pairs") + 1
}

/// The paths of a tree in braces.
fn branches(tree: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut rest = &tree[1..tree.len() - 1];
    while let Some(start) = rest.find(|c: char| c.is_alphanumeric()) {
        let end = rest[start..].find([',', '{']).map_or(rest.len(), |end| start + end);
        let path = rest[start..end].trim();
        if rest[end..].starts_with('{') {
            let length = closing(&rest[end..]);
            let inner = branches(&rest[end..end + length]);
            found.extend(inner.iter().map(|branch| format!("{path}{branch}")));
            rest = &rest[end + length..];
        } else {
            found.push(path.to_owned());
            rest = &rest[end..];
        }
    }
    found
}

/// The module that a path in a module names, or whose item it names; none if it begins with something else.
fn resolve(path: &str, module: &Module, modules: &BTreeSet<Module>) -> Option<Module> {
    let mut segments = path.split("::").peekable();
    let mut found = module.clone();
    match segments.peek().copied() {
        Some("crate") => found.clear(),
        Some("super" | "self") => {}
        child => {
            let child = [&module[..], &[child?.to_owned()]].concat();
            modules.get(&child)?;
        }
    }
    for segment in segments {
        match segment {
            "crate" | "self" => {}
            "super" => drop(found.pop()),
            name => {
                found.push(name.to_owned());
                if !modules.contains(&found) {
                    found.pop();
                    break;
                }
            }
        }
    }
    Some(found)
}

/// Circles of modules, each with all that is in it. That a module uses what it is in is no part of a circle.
fn circles(uses: &Uses) -> Vec<BTreeSet<&Module>> {
    let reach = |from: &Module| {
        let mut reached = BTreeSet::new();
        let mut open = vec![from.clone()];
        while let Some(module) = open.pop() {
            let used = uses.get(&module).into_iter().flatten();
            for used in used.filter(|used| !module.starts_with(used)) {
                if reached.insert(used.clone()) {
                    open.push(used.clone());
                }
            }
        }
        reached
    };
    let reached: BTreeMap<&Module, BTreeSet<Module>> =
        uses.keys().map(|module| (module, reach(module))).collect();
    let mut circles: Vec<BTreeSet<&Module>> = Vec::new();
    for (module, all) in reached.iter().filter(|(module, all)| all.contains(**module)) {
        let circle = reached.iter().filter(|(other, back)| all.contains(**other) && back.contains(*module));
        let circle: BTreeSet<&Module> = circle.map(|(other, _)| *other).collect();
        if !circles.contains(&circle) {
            circles.push(circle);
        }
    }
    circles
}

fn source(path: &str) -> Uses {
    read(&Path::new(env!("CARGO_MANIFEST_DIR")).join(path))
}

#[test]
fn modules_use_only_those_below() {
    let layer = |name: &str| LAYERS.iter().position(|layer| layer.contains(&name));
    for (module, uses) in source("src") {
        // the command line is on top
        let Some(own) = layer(&module[0]) else {
            assert_eq!(module[0], "cli", "{module:?} has no layer");
            continue;
        };
        for used in uses.iter().filter(|used| used[0] != module[0]) {
            assert!(layer(&used[0]) < Some(own), "{} must not use {}", module.join("/"), used.join("/"));
        }
        for used in uses {
            let [module, used] = [&module, &used].map(|module| module.join("/"));
            let broken = NEVER.iter().find(|(one, other, _)| {
                Path::new(&module).starts_with(one) && Path::new(&used).starts_with(other)
            });
            assert!(broken.is_none(), "{module} uses {used}: {broken:?}");
        }
    }
}

#[test]
fn no_circles() {
    for path in [
        "src",
        "tools/reader/src",
        "tools/canvas/src",
        "tools/picture/src",
        "tools/serve/src",
        "tools/output/src",
        "tools/table/src",
    ] {
        let uses = source(path);
        let found = circles(&uses);
        assert!(found.is_empty(), "{path}: {found:?}");
    }
}

#[test]
fn paths_are_found() {
    let text =
        "use crate::{a::{B, c}, d};\nuse super::e::F;\nlet x = g::h(crate::i::J { k });\n// use crate::l;\n";
    let found = paths(&code(text));
    assert_eq!(found, ["crate::a::B", "crate::a::c", "crate::d", "super::e::F", "g::h", "crate::i::J"]);
    let modules = [&["a"][..], &["a", "c"], &["e"], &["m"], &["m", "g"]];
    let module = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Module>();
    let modules: BTreeSet<Module> = modules.into_iter().map(module).collect();
    let resolved: Vec<_> = found.iter().map(|path| resolve(path, &module(&["m"]), &modules)).collect();
    let expected = [
        Some(module(&["a"])),
        Some(module(&["a", "c"])),
        Some(module(&[])),
        Some(module(&["e"])),
        Some(module(&["m", "g"])),
        Some(module(&[])),
    ];
    assert_eq!(resolved, expected);
    let uses = |pairs: &[(&str, &[&str])]| -> Uses {
        pairs
            .iter()
            .map(|(one, others)| (module(&[one]), others.iter().map(|other| module(&[other])).collect()))
            .collect()
    };
    assert_eq!(circles(&uses(&[("a", &["b"]), ("b", &["c"]), ("c", &["b"])])).len(), 1);
    assert!(circles(&uses(&[("a", &["b", "c"]), ("b", &["c"]), ("c", &[])])).is_empty());
}

//! The layout of the project, as tests.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// What each crate may use of ours.
const ARROWS: &[(&str, &[&str])] = &[
    ("library/op", &[]),
    ("cache", &[]),
    ("grammar", &["ivx-op"]),
    ("library/math", &["ivx-op"]),
    ("library/data", &["ivx-op", "ivx-math"]),
    ("library/nn", &["ivx-op", "ivx-math", "ivx-data"]),
    ("library/world", &["ivx-op", "ivx-math", "ivx-data", "ivx-town"]),
    ("library/foreign", &["ivx-op", "ivx-data", "ivx-world"]),
    ("library/figure", &["ivx-op", "ivx-math", "ivx-data", "ivx-world"]),
    ("library/table", &["ivx-op", "ivx-math", "ivx-data"]),
    ("library/town", &[]),
    (
        "library",
        &[
            "ivx-op",
            "ivx-math",
            "ivx-data",
            "ivx-town",
            "ivx-nn",
            "ivx-world",
            "ivx-foreign",
            "ivx-figure",
            "ivx-table",
        ],
    ),
    ("engine", &["ivx-op", "ivx-grammar", "ivx-cache"]),
    ("cli", &["ivx-op", "ivx-math", "ivx-grammar", "ivx-library", "ivx-cache", "ivx-engine"]),
];

#[test]
fn crates_use_only_what_lies_below_them() {
    for (folder, allowed) in ARROWS {
        let manifest = read(&root().join(folder).join("Cargo.toml"));
        let used = manifest.lines().filter(|line| line.starts_with("ivx-"));
        let used: BTreeSet<&str> =
            used.filter_map(|line| line.split(['.', ' ', '=']).next()).collect();
        let allowed: BTreeSet<&str> = allowed.iter().copied().collect();
        assert!(used.is_subset(&allowed), "{folder} uses {used:?}");
    }
}

#[test]
fn what_the_build_does_without_stays_away() {
    let lock = read(&root().join("Cargo.lock"));
    for name in ["icu_segmenter", "supports-color", "miette-derive"] {
        let again = lock.contains(&format!("name = \"{name}\"\n"));
        assert!(!again, "{name} is compiled again: docs/building.md says what for it was not");
    }
}

#[test]
fn each_foreign_crate_is_named_in_one_place() {
    let places = [
        ("dfdx", "library/nn/src/"),
        ("faer", "library/nn/src/"),
        ("nalgebra", "library/"),
        ("pest", "grammar/src/parse"),
        ("nix", "cache/src/"),
        ("sled", "cache/src/hints.rs"),
        ("tar", "cache/src/archive/"),
        ("zstd", "cache/src/"),
        ("miette", "cli/src/render.rs"),
        ("clap", "cli/src/"),
        ("crc32fast", "library/table/src/npz.rs"),
        ("bytes", "library/table/src/parquet.rs"),
        ("csv", "library/table/src/text/"),
        ("fast_float2", "library/table/src/text/"),
        ("flate2", "library/town/src/maps.rs"),
        ("roxmltree", "library/town/src/xodr.rs"),
        ("clap_complete", "cli/src/"),
        ("clap_mangen", "cli/src/command/man.rs"),
        ("ctrlc", "cli/src/main.rs"),
        ("indicatif", "cli/src/progress.rs"),
        ("libloading", "library/foreign/src/procgen/libenv.rs"),
        ("mimalloc", "cli/src/main.rs"),
        ("notify", "cli/src/changes.rs"),
        ("open", "cli/src/command/report.rs"),
        ("miniz_oxide", "library/table/src/npz.rs"),
        ("arrow_array", "cli/src/command/export/parquet.rs"),
        ("futures_util", "cache/src/store/bucket.rs"),
        ("object_store", "cache/src/store/bucket.rs"),
        ("rustls", "cache/src/store/bucket.rs"),
        ("tokio", "cache/src/store/bucket.rs"),
        ("parquet", "cli/src/command/export"),
        ("petgraph", "engine/src/"),
        ("rayon", "engine/src/"),
        ("rustix", "library/foreign/src/"),
        ("safetensors", "library/op/src/artifact.rs"),
        ("strsim", "grammar/src/suggest.rs"),
    ];
    let sources = sources();
    for (name, place) in places {
        let uses = |text: &str| {
            let text = text.split("#[cfg(test)]").next().unwrap_or_default();
            text.contains(&format!("use {name}::"))
                || text.contains(&format!(" {name}::"))
                || text.contains(&format!("({name}::"))
        };
        for (path, text) in &sources {
            let own = path.starts_with(place)
                || (name == "rustix" && path.starts_with("cli/src/cluster/"))
                || (name == "rustix" && path.starts_with("cache/src/exchange.rs"))
                || (name == "petgraph" && path.starts_with("cli/src/command/plan.rs"))
                || (["arrow_array", "parquet"].contains(&name)
                    && path.starts_with("library/table/src/parquet.rs"));
            assert!(own || !uses(text), "{path} names {name}; only {place} may");
        }
        assert!(
            sources.iter().any(|(path, text)| path.starts_with(place) && uses(text)),
            "{name} is unused"
        );
    }
}

#[test]
fn one_module_is_unsafe() {
    const PLACE: &str = "library/foreign/src/procgen/libenv.rs";
    for (path, text) in sources() {
        let mut code = text.lines().filter(|line| !line.trim_start().starts_with("//"));
        let begins = ["{", "extern", "fn", "impl", "trait"].map(|next| format!("unsafe {next}"));
        let is_unsafe = code.any(|line| begins.iter().any(|begin| line.contains(begin)));
        assert_eq!(is_unsafe, path == PLACE, "{path}");
    }
    // All crates have the lints of the workspace, and that one has them but for this.
    let workspace = read(&root().join("Cargo.toml"));
    let lints = |text: &str, head: &str| -> BTreeSet<String> {
        let lines = text.split(head).nth(1).expect("it has lints").lines().skip(1);
        let lines = lines.take_while(|line| !line.is_empty());
        lines.map(|line| line.split('#').next().unwrap_or_default().trim().to_owned()).collect()
    };
    for (folder, _) in ARROWS {
        let manifest = read(&root().join(folder).join("Cargo.toml"));
        if *folder != "library/foreign" {
            assert!(manifest.contains("[lints]\nworkspace = true"), "{folder}");
            continue;
        }
        for tool in ["rust", "clippy"] {
            let shared = lints(&workspace, &format!("[workspace.lints.{tool}]"));
            let own = lints(&manifest, &format!("[lints.{tool}]"));
            let more: Vec<&String> = own.symmetric_difference(&shared).collect();
            let expected: &[&str] = match tool {
                "rust" => &["unsafe_code = \"deny\"", "unsafe_code = \"forbid\""],
                _ => &["undocumented_unsafe_blocks = \"warn\""],
            };
            assert_eq!(more, expected, "{folder}, {tool}");
        }
    }
}

#[test]
fn everything_declared_is_registered_and_documented() {
    let registry = ivx_library::registry();
    let mut declared = 0;
    for (path, text) in sources().iter().filter(|(path, _)| path.starts_with("library/src/")) {
        let text = text.split("#[cfg(test)]").next().unwrap_or_default();
        for line in text.lines().filter(|line| line.contains("struct ") && line.contains("\" @ ")) {
            let name = line.split('"').nth(1).expect("the name stands between quotes");
            assert!(
                registry.decl(name).is_some(),
                "{path}: `{name}` is declared and not registered"
            );
            declared += 1;
        }
    }
    assert!(declared > 40, "{declared} declarations are found");
    for decl in registry.decls() {
        assert!(decl.docs.trim().len() > 10, "`{}` has no docs", decl.name);
        for arg in &decl.args {
            assert!(!arg.docs.trim().is_empty(), "`{}.{}` has no docs", decl.name, arg.name);
        }
    }
}

#[test]
fn the_operations_that_the_language_needs_are_there() {
    let registry = ivx_library::registry();
    for name in [
        "add",
        "sub",
        "mul",
        "div",
        "neg",
        "select",
        "select_range",
        "published",
        "claim",
        "resample",
        "less",
        "at_most",
        "greater",
        "at_least",
        "equal",
        "unequal",
    ] {
        assert!(registry.decl(name).is_some(), "{name}");
    }
}

#[test]
fn files_answer_one_question() {
    for (path, text) in sources().into_iter().filter(|(path, _)| !path.contains("/tests")) {
        let code = text.split("#[cfg(test)]").next().unwrap_or_default();
        let lines = code.lines().count();
        assert!(lines <= 480, "{path} has {lines} lines without its tests");
        assert!(text.trim_start().starts_with("//!"), "{path} does not say what it is");
    }
}

fn sources() -> Vec<(String, String)> {
    let mut sources = BTreeMap::new();
    for (folder, _) in ARROWS {
        collect(&root().join(folder).join("src"), &mut sources);
    }
    sources.into_iter().collect()
}

fn collect(folder: &Path, sources: &mut BTreeMap<String, String>) {
    for entry in fs::read_dir(folder).expect("source folders can be read").flatten() {
        let path = entry.path();
        if path.is_dir() {
            collect(&path, sources);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let name = path.strip_prefix(root()).expect("sources lie below the root");
            sources.insert(name.display().to_string(), read(&path));
        }
    }
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

//! Generates `include/armesh.h` from `src/capi` and compares it with the committed file.
//! `ARMESH_UPDATE_HEADER=1 cargo test --release --test header` writes it.

use std::fmt::Write;
use std::path::{Path, PathBuf};

/// The sections of the header, in its order: one file of `src/capi` each.
const NOUNS: [&str; 13] = [
    "version",
    "status",
    "error",
    "progress",
    "cancel",
    "mesh",
    "diagnostics",
    "compute",
    "results",
    "geodesic",
    "segment",
    "feature",
    "ply",
];

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// The `//!` lines of a Rust file, without the mark.
fn module_doc(source: &str) -> impl Iterator<Item = &str> {
    source.lines().map_while(|l| l.strip_prefix("//!"))
}

/// What cbindgen makes of one file: types and functions, nothing around them.
fn section(path: &Path) -> String {
    let config = cbindgen::Config::from_file(root().join("cbindgen.toml")).expect("cbindgen.toml");
    let config = cbindgen::Config { no_includes: true, ..config };
    let bindings = cbindgen::Builder::new().with_config(config).with_src(path).generate().expect("cbindgen");
    let mut out = Vec::new();
    bindings.write(&mut out);
    let text = String::from_utf8(out).expect("UTF-8");
    let negative = |line: &str| line.starts_with("#define") && line.contains(" -");
    // one way to name a type, and constants that are safe in every expression
    let lines = text.lines().map(|line| match line {
        line if negative(line) => line.replacen(" -", " (-", 1) + ")",
        line if line.starts_with("typedef") => line.into(),
        line => line.replace("struct ar_", "ar_"),
    });
    lines.collect::<Vec<_>>().join("\n") + "\n"
}

/// `ar_x_init(&x)` for every `ar_x_init_sized(&x, size)`: the size must be that of the caller's header, so it is inline.
fn with_inits(section: &str) -> String {
    let mut out = String::new();
    for part in section.split_inclusive(";\n") {
        out.push_str(part);
        let Some((_, rest)) = part.rsplit_once("ar_status ar_") else { continue };
        let Some((name, parameters)) = rest.split_once("_init_sized(") else { continue };
        let argument = parameters.rsplit_once(',').map_or("", |(first, _)| first);
        let argument = argument.rsplit_once(['*', ' ']).map_or("", |(_, a)| a);
        write!(
            out,
            "\n/// Sets `{argument}` to the defaults of this header's version.\n\
             static inline ar_status ar_{name}_init(ar_{name} *{argument}) {{\n  \
             return ar_{name}_init_sized({argument}, (uint32_t)sizeof *{argument});\n}}\n"
        )
        .unwrap();
    }
    out
}

fn generate() -> String {
    let source = |noun: &str| std::fs::read_to_string(root().join(format!("src/capi/{noun}.rs"))).expect(noun);
    let mut out = String::from("#ifndef ARMESH_H\n#define ARMESH_H\n\n");
    for line in module_doc(&source("mod")) {
        writeln!(out, "//{line}").unwrap();
    }
    out += "//\n// Generated from src/capi by cbindgen; edit there.\n\n#include <stddef.h>\n#include <stdint.h>\n\n\
            #ifdef __cplusplus\nextern \"C\" {\n#endif\n";
    for noun in NOUNS {
        let rule = "=".repeat(110);
        writeln!(out, "\n// {rule}").unwrap();
        module_doc(&source(noun)).for_each(|line| writeln!(out, "//{line}").unwrap());
        writeln!(out, "// {rule}\n").unwrap();
        out += with_inits(&section(&root().join(format!("src/capi/{noun}.rs")))).trim_start();
    }
    out + "\n#ifdef __cplusplus\n}\n#endif\n\n#endif // ARMESH_H\n"
}

#[test]
fn the_committed_header_is_what_the_source_says() {
    let (made, path) = (generate(), root().join("include/armesh.h"));
    if std::env::var_os("ARMESH_UPDATE_HEADER").is_some() {
        std::fs::write(&path, &made).expect("writing the header");
    }
    let committed = std::fs::read_to_string(&path).unwrap_or_default();
    let differs = made.lines().zip(committed.lines()).position(|(a, b)| a != b);
    assert!(
        made == committed,
        "include/armesh.h is stale from line {:?}: run ARMESH_UPDATE_HEADER=1 cargo test --release --test header",
        differs.map(|l| l + 1)
    );
}

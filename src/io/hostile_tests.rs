//! Small valid files of every format, cut off and flipped: each must read or be refused, quickly and without a panic.

use super::{LOAD_UNITS, Limits, Unit, load, parse, write_ply};
use crate::error::{Error, Result};
use crate::job::{CancelToken, Job, Stage};
use std::time::Instant;

/// Named small files: (extension, contents).
fn samples() -> Vec<(&'static str, Vec<u8>)> {
    let stl = "solid cube\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n\
        facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1.5e3 0\nendloop\nendfacet\nendsolid cube\n";
    let obj =
        "# x\nv 0 0 0\nv 1 0 0 1\nv 0 1 0 1 1 1\nv 0 0 1\nvn 0 0 1\nf 1//1 2//1 -2//1\nf 1/1/1 2/1/1 3/1/1 4/1/1\n";
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty double z\n\
        property list uchar int extra\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
        0 0 0 1 5\n1 0 0 0\n0 1 0 0\n3 0 1 2\n";
    let mut binary_stl = vec![0u8; 84 + 3 * 50];
    binary_stl[..5].copy_from_slice(b"solid");
    binary_stl[80] = 3;
    let mut binary_ply = Vec::new();
    let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    write_ply(&mut binary_ply, &points, &[[0, 1, 2]], Some(&[[1; 3]; 3]), &[("d1", &[0.0; 3])]).unwrap();
    let big_ply = String::from_utf8_lossy(&binary_ply).replace("little", "big").into_bytes();
    vec![
        ("stl", stl.into()),
        ("stl", binary_stl),
        ("obj", obj.into()),
        ("ply", ply.into()),
        ("ply", binary_ply),
        ("ply", big_ply),
        ("3mf", super::threemf_tests::simple()),
    ]
}

fn try_read(bytes: &[u8], extension: &str) -> Result<super::RawMesh> {
    let start = Instant::now();
    let result = parse(bytes, extension, &Limits::default(), &Job::new(1, Some(1 << 30), CancelToken::default()));
    assert!(start.elapsed().as_secs() < 5, "slow");
    if let Ok(mesh) = &result {
        // What is read cannot outgrow what was there: a corner takes at least one byte, or half a bit when packed.
        assert!(mesh.triangles.len() <= 2000 * bytes.len());
    }
    result
}

#[test]
fn files_that_are_cut_off_anywhere() {
    for (extension, bytes) in samples() {
        for end in 0..bytes.len() {
            for extension in [extension, ""] {
                let _ = try_read(&bytes[..end], extension);
            }
        }
        if extension != "ply" || !String::from_utf8_lossy(&bytes).contains("big") {
            assert!(try_read(&bytes, "").is_ok(), "{extension}");
        }
    }
}

#[test]
fn files_with_flipped_bits_and_foreign_bytes() {
    // xorshift64*, fixed seed.
    let mut state = 0x9E37_79B9_7F4A_7C15u64;
    let mut random = |n: usize| {
        state ^= state >> 12;
        state ^= state << 25;
        state ^= state >> 27;
        (state.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 33) as usize % n
    };
    for (extension, bytes) in samples() {
        for round in 0..4000 {
            let mut bad = bytes.clone();
            for _ in 0..1 + random(4) {
                let at = random(bad.len());
                match round % 4 {
                    0 => bad[at] ^= 1 << random(8),
                    1 => bad[at] = [0, 0xff, b'-', b'9', b' ', b'\n', b'e', 0x80][random(8)],
                    2 => drop(bad.splice(at..at, vec![b'9'; 1 + random(20)])),
                    _ => drop(bad.drain(at..(at + random(30)).min(bad.len() - 1).max(at))),
                }
            }
            let _ = try_read(&bad, if round % 3 == 0 { "" } else { extension });
        }
    }
}

#[test]
fn nothing_and_nonsense() {
    for extension in ["stl", "obj", "ply", "3mf", "", "docx"] {
        assert!(matches!(try_read(b"", extension), Err(Error::Format(m)) if m.contains("empty")));
        for nonsense in [&b"\0"[..], b"\n", b"#", b"ply", b"solid", b"PK", b"\xff\xfes\0o\0", &[0; 83], &[0xff; 200]] {
            assert!(try_read(nonsense, extension).is_err(), "{extension}: {nonsense:?}");
        }
    }
    let many = "f 1\n".repeat(300_000);
    assert!(matches!(try_read(many.as_bytes(), "obj"), Err(Error::Empty(_))));
    for line in ["element e# 1\n", "property int p#\n"] {
        let lines: String = (0..300_000).map(|i| line.replace('#', &i.to_string())).collect();
        let header = format!("ply\nformat ascii 1.0\nelement vertex 1\n{lines}");
        assert!(matches!(try_read(header.as_bytes(), "ply"), Err(Error::Format(m)) if m.contains("too many")));
    }
}

#[test]
fn the_contents_decide_not_the_name() {
    for (extension, bytes) in samples() {
        let wanted = try_read(&bytes, extension);
        for other in ["stl", "obj", "ply", "3mf", "txt", ""] {
            assert_eq!(try_read(&bytes, other), wanted, "{extension} as {other}");
        }
    }
}

/// A folder of this test's own, removed at the end.
struct Scratch(std::path::PathBuf);

impl Scratch {
    fn new(name: &str) -> Scratch {
        let path = std::env::temp_dir().join(format!("armesh-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Scratch(path)
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[test]
fn files_are_loaded_with_progress_budget_and_cancel() {
    let scratch = Scratch::new("load");
    let path = scratch.0.join("a.stl");
    let n = 200_000u32;
    let mut bytes = vec![0u8; 84 + 50 * n as usize];
    bytes[80..84].copy_from_slice(&n.to_le_bytes());
    std::fs::write(&path, &bytes).unwrap();
    let limits = Limits::default();

    let job = Job::new(1, None, CancelToken::default());
    let mut seen = Vec::new();
    let mesh = job.run(
        Some(&mut |f, _| {
            seen.push(f);
            true
        }),
        || {
            // Twice the units of a load, so that one too many would show as much as one too few.
            job.begin(Stage::Mesh, 0.0, 1.0, 2 * LOAD_UNITS)?;
            let mesh = load(&path, &limits, &job);
            std::thread::sleep(std::time::Duration::from_millis(200));
            mesh
        },
    );
    let mesh = mesh.unwrap();
    assert_eq!((mesh.triangles.len(), mesh.unit), (n as usize, Unit::Unknown));
    assert!(seen.contains(&0.5) && seen.iter().all(|&f| f <= 0.5 || f == 1.0), "{seen:?}");

    let budget = Job::new(1, Some(bytes.len() as u64 + 84 * n as u64 - 1), CancelToken::default());
    assert!(matches!(load(&path, &limits, &budget), Err(Error::Budget(_))));
    let budget = Job::new(1, Some(bytes.len() as u64 + 84 * n as u64), CancelToken::default());
    assert!(load(&path, &limits, &budget).is_ok());
    let token = CancelToken::default();
    token.cancel();
    assert_eq!(load(&path, &limits, &Job::new(1, None, token)), Err(Error::Cancelled));
    let small = Limits { file_bytes: 1000, ..limits };
    assert!(matches!(load(&path, &small, &job), Err(Error::Budget(m)) if m.contains("a.stl") && m.contains("1000")));
    let missing = scratch.0.join("b.stl");
    assert!(matches!(load(&missing, &limits, &job), Err(Error::Io(m)) if m.contains("b.stl")));
    assert!(matches!(load(&scratch.0, &limits, &job), Err(Error::Io(m)) if m.contains("not a regular file")));
}

/// Real printable parts, where the checkout has them beside it (`ARMESH_PARTS` or `../shared/parts`).
#[test]
fn real_parts_load() {
    let beside = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/parts");
    let folder = std::env::var_os("ARMESH_PARTS").map_or(beside, Into::into);
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for path in entries.flatten().map(|e| e.path()).filter(|p| p.extension().is_some_and(|e| e == "stl")) {
        let mesh = load(&path, &Limits::default(), &Job::default()).unwrap();
        assert!(mesh.positions.len() == 3 * mesh.triangles.len() && mesh.warnings.is_empty(), "{path:?}");
        let bytes = std::fs::read(&path).unwrap();
        let text = bytes.windows(8).filter(|w| w.eq_ignore_ascii_case(b"endfacet")).count();
        let facets = if text > 0 { text } else { (bytes.len() - 84) / 50 };
        assert_eq!(mesh.triangles.len(), facets, "{path:?}");
    }
}

//! The composite solids of the segmentation tests: written as OFF files with their true parts, one label a face, or
//! partitioned in every way that the library has, with the adjusted Rand index to the true parts.
//!
//! ```sh
//! cargo run --release --example composites -- DIRECTORY [CELL]
//! cargo run --release --example composites -- --criteria [CELL]
//! ```

use armesh::job::{CancelToken, Job};
// the shapes refer to the library as the tests see it
use armesh::mesh;
use armesh::mesh::{MeshOptions, TriMesh};
use armesh::segment::{Criterion, Method, SegmentOptions, segment};

#[allow(dead_code)]
#[path = "../../src/segment/testshapes.rs"]
mod testshapes;

use std::io::Write;
use testshapes::{Composite, adjusted_rand};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let words: Vec<String> = std::env::args().collect();
    let first = words.get(1).ok_or("a directory, or --criteria")?;
    let cell = words.get(2).map_or(Ok(1.0), |c| c.parse())?;
    for shape in testshapes::composites(cell) {
        if first == "--criteria" {
            compare(&shape)?;
        } else {
            write(&shape, first)?;
        }
    }
    Ok(())
}

fn write(shape: &Composite, directory: &str) -> std::io::Result<()> {
    std::fs::create_dir_all(directory)?;
    let name = format!("{directory}/{}", shape.name.replace(' ', "-"));
    let mut out = std::io::BufWriter::new(std::fs::File::create(format!("{name}.off"))?);
    writeln!(out, "OFF\n{} {} 0", shape.positions.len(), shape.triangles.len())?;
    for [x, y, z] in &shape.positions {
        writeln!(out, "{x} {y} {z}")?;
    }
    for [a, b, c] in &shape.triangles {
        writeln!(out, "3 {a} {b} {c}")?;
    }
    out.flush()?;
    let label: Vec<String> = shape.label.iter().map(u32::to_string).collect();
    std::fs::write(format!("{name}.labels"), label.join("\n") + "\n")
}

/// One line a method and criterion.
fn compare(shape: &Composite) -> armesh::error::Result<()> {
    let count = shape.label.iter().max().map_or(0, |last| last + 1);
    let base = SegmentOptions { measure: false, ..SegmentOptions::default() };
    let landmarks = SegmentOptions { method: Method::Landmarks, ..base };
    let mut ways = vec![
        ("creases".to_owned(), base),
        ("landmarks, number given".to_owned(), SegmentOptions { count: Some(count), ..landmarks }),
    ];
    for criterion in [Criterion::Creases, Criterion::Eigengap, Criterion::Silhouette] {
        ways.push((format!("landmarks, {criterion:?}"), SegmentOptions { criterion, ..landmarks }));
    }
    let job = Job::new(0, None, CancelToken::default());
    let source = (&shape.positions[..], &shape.triangles[..]);
    let mesh = job.run(None, || TriMesh::new(&source, &MeshOptions::default(), &job))?;
    // faces without area are left out of the mesh
    let label: Vec<u32> = mesh.input_of_face().iter().map(|&f| shape.label[f as usize]).collect();
    for (name, options) in ways {
        let found = job.run(None, || segment(&mesh, &options, &job))?;
        let (n, index) = (found.segments.len(), adjusted_rand(&found.face_segment, &label));
        println!("{:16} {name:24} {n:3} of {count} segments, index {index:.3}", shape.name);
    }
    Ok(())
}

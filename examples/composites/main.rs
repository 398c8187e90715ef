//! Writes the composite solids of the segmentation tests as OFF files with their true parts, one label a face:
//!
//! ```sh
//! cargo run --release --example composites -- DIRECTORY [CELL]
//! ```

// the shapes refer to the library as the tests see it
use armesh::mesh;

#[allow(dead_code)]
#[path = "../../src/segment/testshapes.rs"]
mod testshapes;

use std::io::Write;

fn main() -> std::io::Result<()> {
    let words: Vec<String> = std::env::args().collect();
    let directory = words.get(1).expect("a directory");
    let cell = words.get(2).map_or(1.0, |c| c.parse().expect("a number"));
    std::fs::create_dir_all(directory)?;
    for shape in testshapes::composites(cell) {
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
        std::fs::write(format!("{name}.labels"), label.join("\n") + "\n")?;
    }
    Ok(())
}

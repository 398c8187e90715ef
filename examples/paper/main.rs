//! The paper's results and ours side by side, figure by figure:
//!
//! ```sh
//! cargo run --release --example paper            # writes docs/paper.md and docs/paper/
//! ```
//!
//! R. Ge and J. Flynn, "A computational method for detecting aspect ratio and problematic features in additive
//! manufacturing", J. Intell. Manuf. 33 (2022) 519-535. The shapes are made here, from the dimensions that it gives.

mod composites;
mod document;
#[path = "../render/image.rs"]
#[allow(dead_code)]
mod image;
mod measure;
#[path = "../render/palette.rs"]
mod palette;
mod pictures;
mod plots;
#[path = "../render/raster.rs"]
#[allow(dead_code)]
mod raster;
mod shapes;
mod studies;

use document::Document;
use plots::Axes;
use std::error::Error;
use std::path::Path;

/// About as many triangles a shape as the paper took ("over 10000").
const FACES: usize = 12_000;
const ANGLES: [f64; 7] = [180.0, 210.0, 240.0, 270.0, 300.0, 330.0, 360.0];

fn main() -> Result<(), Box<dyn Error>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut page = Document::new(&root.join("docs/paper"))?;
    page.text(include_str!("text/opening.md"));

    page.text(include_str!("text/fields.md"));
    page.distributions(&studies::distributions(FACES)?)?;

    page.text(include_str!("text/squares.md"));
    let lengths = [0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 200.0, 500.0, 1000.0, 2000.0];
    let squares = studies::squares(&lengths, FACES)?;
    page.squares(&squares)?;
    page.table("shape", &squares);

    page.text(include_str!("text/ellipsoids.md"));
    let rows = studies::ellipsoids(&[1.0, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0], 12_000)?;
    let axes = Axes { title: "Ellipsoids (Fig. 14)", x: "AR", y: "D1max/D2max", log: false };
    page.plot("ellipsoids.svg", &axes, &rows, Some(("AR", &|x| x)))?;
    page.table("semi-axes", &rows);

    page.text(include_str!("text/polyhedra.md"));
    page.table("shape", &studies::polyhedra(FACES)?);

    page.text(include_str!("text/rods.md"));
    let rows = studies::curved_rods(&ANGLES, [8, 12], 6)?;
    let axes = Axes { title: "Curved rod, AR 20 (Fig. 16)", x: "angle, degrees", y: "D1max/D2max", log: false };
    page.plot("rods.svg", &axes, &rows, Some(("AR", &|_| 20.0)))?;
    page.table("bent by", &rows);

    page.text(include_str!("text/walls.md"));
    let rows = studies::curved_walls(&ANGLES, 56)?;
    let axes = Axes { title: "Curved wall, AR 1000 (Fig. 17)", x: "angle, degrees", y: "D1max/D2max", log: false };
    page.plot("walls.svg", &axes, &rows, Some(("AR", &|_| 1000.0)))?;
    page.table("bent by", &rows);
    page.cones(&studies::wall_by_cone(&[120.0, 90.0, 60.0, 30.0], 56)?);

    page.text(include_str!("text/helices.md"));
    let rows = studies::helices(&[0.0, 6.0, 10.0, 20.0, 40.0, 60.0, 80.0], [8, 12], 6)?;
    let axes = Axes { title: "Helix, AR 31.4 (Fig. 18)", x: "H, mm", y: "D1max/D2max", log: false };
    page.plot("helices.svg", &axes, &rows, Some(("AR", &|_| 31.4)))?;
    page.table("rise", &rows);

    page.text(include_str!("text/sensitivity.md"));
    page.sensitivity(&studies::sensitivity(&[10.0, 100.0, 1000.0], &[4, 8, 16, 32])?)?;

    page.text(include_str!("text/composites.md"));
    page.composites(&composites::composites(&root.join("examples"))?)?;

    page.text(include_str!("text/rings.md"));
    page.rings(&studies::rings(8)?);
    page.text(include_str!("text/quality.md"));
    page.quality(&studies::mesh_quality(FACES)?);

    std::fs::write(root.join("docs/paper.md"), page.finish().trim_end().to_owned() + "\n")?;
    println!("docs/paper.md");
    Ok(())
}

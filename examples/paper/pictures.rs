//! Pictures of parts, by the rasteriser of the project's `render` example.

use super::image::Image;
use super::palette::Scale;
use super::raster::{BACKGROUND, Frame, Paint, View, render};
use armesh::mesh::TriMesh;
use std::error::Error;
use std::path::Path;

const VIEW: View = View { azimuth: -60.0, elevation: 28.0 };
const SIZE: [usize; 2] = [460, 360];

fn draw(mesh: &TriMesh, paint: &Paint<'_>, beside: usize) -> Image {
    let [width, height] = SIZE;
    let mut picture = Image::new(width + beside, height, BACKGROUND);
    let frame = Frame { width, height, fit: [14, 14, width - 28, height - 28] };
    picture.paste(&render(mesh.positions(), mesh.triangles(), paint, VIEW, frame), 0, 0);
    picture
}

/// The part coloured by a value at its vertices, with a legend.
pub fn by_vertex(path: &Path, mesh: &TriMesh, values: &[f64], name: &str, log: bool) -> Result<(), Box<dyn Error>> {
    let scale = Scale::of(values, 0.005, log);
    let mut picture = draw(mesh, &Paint::Vertex(values, scale), 120);
    picture.color_bar(SIZE[0] as i64 + 10, 60, SIZE[1] as i64 - 100, &scale, name, 3);
    picture.save(path)
}

/// The part coloured by segment.
pub fn by_segment(path: &Path, mesh: &TriMesh, segment: &[u32]) -> Result<(), Box<dyn Error>> {
    let ids: Vec<i64> = segment.iter().map(|&s| i64::from(s)).collect();
    draw(mesh, &Paint::Id(&ids), 0).save(path)
}

//! A shape through the library, in either profile.

use super::shapes::Shape;
use armesh::error::Result;
use armesh::field::{self, Field, Options, Profile, Summary};
use armesh::geodesic::Mode;
use armesh::job::{CancelToken, Job};
use armesh::mesh::{MeshOptions, TriMesh};
use armesh::segment::{SegmentOptions, Segmentation, segment};

/// A shape and what was measured on it.
pub struct Measured {
    pub mesh: TriMesh,
    pub field: Field,
    pub summary: Summary,
}

impl Measured {
    /// D1max / D2max.
    pub fn ratio(&self) -> f64 {
        self.summary.ratio_max
    }
}

fn job() -> Job {
    Job::new(0, None, CancelToken::default())
}

/// The shape as the library holds it.
pub fn mesh(shape: &Shape) -> Result<TriMesh> {
    let source = (&shape.positions[..], &shape.triangles[..]);
    let job = job();
    job.run(None, || TriMesh::new(&source, &MeshOptions::default(), &job))
}

/// Measures a shape with the profile's own settings.
pub fn measure(shape: &Shape, profile: Profile) -> Result<Measured> {
    // the tolerances that the C interface takes by default
    let tolerance = if profile == Profile::Paper { 0.02 } else { 0.05 };
    measured(shape, Options { profile, d1: Mode::Certified { tolerance }, ..Options::default() })
}

/// The paper's profile with rays in a cone of this full angle, radians.
pub fn measure_with_cone(shape: &Shape, cone_angle: f64) -> Result<Measured> {
    let d1 = Mode::Certified { tolerance: 0.02 };
    measured(shape, Options { profile: Profile::Paper, d1, cone_angle, ..Options::default() })
}

fn measured(shape: &Shape, options: Options) -> Result<Measured> {
    let mesh = mesh(shape)?;
    let job = job();
    let field = job.run(None, || field::compute(&mesh, &options, &job))?;
    let summary = field.summary();
    Ok(Measured { mesh, field, summary })
}

/// Segments of a shape: as many as asked for, or as the library finds.
pub fn segments(mesh: &TriMesh, count: Option<u32>) -> Result<Segmentation> {
    let job = job();
    job.run(None, || segment(mesh, &SegmentOptions { count, ..SegmentOptions::default() }, &job))
}

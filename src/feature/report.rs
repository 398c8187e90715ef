//! Features as a report: JSON (`docs/report-schema.json`), and coloured PLY.

use super::limits::{ProcessLimits, Verdict};
use super::{Feature, Features};
use crate::error::{Result, try_vec};
use crate::io::colour::colour_of;
use crate::io::{save_ply, write_face_ply};
use crate::job::Job;
use crate::mesh::{NONE, TriMesh};
use crate::thickness::wall::WallMesh;
use serde_json::{Value, json};
use std::path::Path;

/// Name and version of the report's schema.
pub const SCHEMA: &str = "armesh-report/1";

/// What a coloured mesh is coloured by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColourBy {
    /// Each feature has a colour of its own.
    Feature,
    /// The ratio of the feature.
    Ratio,
    /// The wall width at the face.
    Width,
}

impl Features {
    /// The report: an object with `report_schema`, `unit` (null if unknown), `limits`, `features` (worst first) and
    /// `face_feature` (one id for each triangle of the input in its order, -1 for none). Lengths in model units; null
    /// where there is no value.
    pub fn to_json(&self, mesh: &TriMesh, limits: &ProcessLimits, unit: Option<&str>) -> String {
        let features: Vec<Value> = self
            .by_severity(limits)
            .into_iter()
            .map(|(id, verdict)| feature(id, verdict, &self.features[id]))
            .collect();
        let report = json!({
            "report_schema": SCHEMA,
            "unit": unit,
            "limits": {
                "warn_ratio": limits.warn_ratio,
                "error_ratio": limits.error_ratio,
                "min_width": limits.min_width,
            },
            "features": features,
            "face_feature": self.face_feature_of_input(mesh).collect::<Vec<i32>>(),
        });
        format!("{report:#}\n")
    }

    /// Feature of each triangle of the input, -1 for those that take no part.
    pub fn face_feature_of_input<'a>(&'a self, mesh: &'a TriMesh) -> impl Iterator<Item = i32> + 'a {
        mesh.face_of_input().iter().map(|&f| if f == NONE { -1 } else { self.face_feature[f as usize] as i32 })
    }

    /// Ids and verdicts of the features, worst first: by severity, then by falling ratio, then by id.
    pub fn by_severity(&self, limits: &ProcessLimits) -> Vec<(usize, Verdict)> {
        let mut all: Vec<(usize, Verdict)> =
            self.features.iter().enumerate().map(|(id, f)| (id, limits.judge(f))).collect();
        let ratio = |id: usize| if self.features[id].ratio.is_nan() { -1.0 } else { self.features[id].ratio };
        all.sort_by(|a, b| b.1.severity.cmp(&a.1.severity).then(ratio(b.0).total_cmp(&ratio(a.0))).then(a.0.cmp(&b.0)));
        all
    }

    /// Writes welded vertices and kept faces as binary PLY, each face with a colour and the scalars `feature`, `ratio` (of
    /// its feature) and, by width, `width` (at its centroid).
    ///
    /// # Errors
    /// [`crate::error::Error::Io`], those of [`WallMesh::new`] and [`WallMesh::surface_widths`].
    pub fn save_ply(&self, mesh: &TriMesh, path: &Path, by: ColourBy, job: &Job) -> Result<()> {
        let triangles = mesh.topology()?.oriented(mesh.triangles());
        let mut ids = try_vec(triangles.len(), "colours")?;
        ids.extend(self.face_feature.iter().map(|&k| f64::from(k)));
        let mut ratios = try_vec(triangles.len(), "colours")?;
        ratios.extend(self.face_feature.iter().map(|&k| self.features[k as usize].ratio));
        let mut scalars: Vec<(&str, &[f64])> = vec![("feature", &ids), ("ratio", &ratios)];
        let widths;
        let colours: Vec<[u8; 3]> = match by {
            ColourBy::Feature => self.face_feature.iter().map(|&k| colour_of_feature(k)).collect(),
            ColourBy::Ratio => scaled(&ratios),
            ColourBy::Width => {
                let walls = WallMesh::new(mesh.positions(), &triangles, job)?;
                widths = walls.surface_widths(mesh.positions(), &triangles, job)?.1;
                scalars.push(("width", &widths));
                scaled(&widths)
            }
        };
        save_ply(path, |out| write_face_ply(out, mesh.positions(), &triangles, Some(&colours), &scalars))
    }
}

/// Colours from the least to the greatest value.
fn scaled(values: &[f64]) -> Vec<[u8; 3]> {
    let finite = values.iter().copied().filter(|x| x.is_finite());
    let (lo, hi) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), x| (lo.min(x), hi.max(x)));
    values.iter().map(|&x| colour_of(x, lo, hi)).collect()
}

/// A colour for a number: hues by the golden angle, so that neighbours in number differ; the first is grey.
pub fn colour_of_feature(id: u32) -> [u8; 3] {
    if id == 0 {
        return [190, 190, 196];
    }
    let hue = (f64::from(id) * 0.618_033_988_75).fract() * 6.0;
    let value = [1.0, 0.8, 0.62][id as usize % 3];
    [0.0, 4.0, 2.0].map(|shift| {
        let x: f64 = ((hue + shift) % 6.0 - 3.0).abs() - 1.0;
        ((0.15 + 0.85 * x.clamp(0.0, 1.0)) * value * 255.0).round() as u8
    })
}

fn feature(id: usize, verdict: Verdict, f: &Feature) -> Value {
    let mut reasons = Vec::new();
    if verdict.slender {
        reasons.push("ratio");
    }
    if verdict.thin {
        reasons.push("width");
    }
    json!({
        "id": id,
        "kind": f.kind.name(),
        "severity": verdict.severity.name(),
        "reasons": reasons,
        "ratio": f.ratio,
        "ratio_range": f.ratio_range,
        "d1_max": f.d1_max,
        "d1_upper": f.d1_upper,
        "d1_ends": f.d1_ends,
        "d2_max": f.d2_max.width,
        "d2_max_at": f.d2_max.at,
        "d2_max_contacts": f.d2_max.contacts,
        "d2_min": f.d2_min.width,
        "d2_min_at": f.d2_min.at,
        "d2_min_contacts": f.d2_min.contacts,
        "length": f.dimensions[0],
        "width": f.dimensions[1],
        "thickness": f.dimensions[2],
        "faces": f.faces,
        "area": f.area,
        "centroid": f.centroid,
        "box": { "center": f.bounds.centre, "axes": f.bounds.axes, "size": f.bounds.size },
    })
}

//! The measures of one feature: its thickness, its height above what it stands on, its length.

use super::foot::Standing;
use super::kind;
use super::lengths::{self, Length};
use super::skin::Skin;
use super::widths::{Place, quantile};
use super::{Feature, Width};
use crate::error::{Error, Result};
use crate::job::Job;
use crate::mesh::NONE;
use crate::mesh::measure::{Vec3, add, cross, distance, dot, norm, scale, sub};
use crate::mesh::proxy::REFERENCE_LIMIT;
use crate::mesh::sets::SparseSets;
use crate::segment::ring;
use std::collections::BTreeMap;

/// Only where both sides of a width are the feature's own counts if that is more than this share of its area: the edge
/// of a ridge is thin, but the ridge is as thick as what it sits on.
const OWN: f64 = 0.62;
/// The widest tenth of a feature's area may be corners and nodes, in which walls and bars meet: how wide the feature is
/// there at most is told from how its width spreads from the half of its area to nine tenths of it, ...
const TYPICAL: [f64; 2] = [0.5, 0.9];
/// ... going on like this: the width of a cone grows by a quarter of that once more.
const GROWTH: f64 = 0.35;
/// A feature lower than wide is as thick as it is high; but one lower than this share of its width is a relief on its
/// body, which stiffens it.
const RELIEF: f64 = 0.25;
/// Where that much of its area ...
const MOSTLY: f64 = 0.6;
/// ... is equally wide, within this share, that is how wide it is: the rest are heads, feet, corners and nodes.
const EVEN: f64 = 0.03;
/// What may lie off the plane of a feature's border, as a share of the width of the feature.
const LEVEL: f64 = 0.1;

/// A part and its features.
pub struct Scene<'a> {
    /// Its surface.
    pub skin: &'a Skin<'a>,
    /// The features of its faces.
    pub label: &'a [u32],
}

impl Scene<'_> {
    /// Measures feature `k`, given its faces and the places on them; for `haste` see [`lengths::longest`].
    pub fn measure(&self, k: u32, faces: &[u32], places: Vec<&Place>, haste: bool, job: &Job) -> Result<Feature> {
        job.check()?;
        let Skin { positions, triangles, whole, .. } = *self.skin;
        let (centroid, area) = lengths::centroid(positions, triangles, faces);
        // a very large part in one piece has a reference, and needs no copy of itself
        let whole = whole.filter(|_| faces.len() == triangles.len() && faces.len() > REFERENCE_LIMIT);
        let known = whole.map(|mesh| mesh.reference(job)).transpose()?.flatten();
        let extracted;
        let own = match known {
            Some(_) => (positions, triangles),
            None => {
                extracted = lengths::extract(positions, triangles, faces)?;
                (&extracted.0[..], &extracted.1[..])
            }
        };
        let (d2_max, d2_min) = self.widths(k, places, faces)?;
        let simpler = if known.is_none() { lengths::simpler(own.0, own.1, job)? } else { None };
        let solved = known.or(simpler.as_ref()).map_or(own, |s| (&s.positions, &s.triangles));
        let (length, is_ring) = self.length(k, faces, (d2_max.width, haste), solved, job)?;
        let (d1_max, d1_upper, d1_ends) =
            length.as_ref().map_or((f64::NAN, f64::NAN, [[f64::NAN; 3]; 2]), |l| (l.length, l.upper, l.ends));
        let (kind, width) = kind::classify(d1_max, d2_max.width, area, is_ring);
        let long = if is_ring { 2.0 * d1_max } else { d1_max };
        Ok(Feature {
            kind,
            ratio: d1_max / d2_max.width,
            ratio_range: [d1_max / d2_max.width, d1_upper / d2_max.width],
            d1_max,
            d1_upper,
            d1_ends,
            d2_max,
            d2_min,
            dimensions: [long, width, d2_max.width],
            faces: faces.len() as u32,
            area,
            centroid,
            bounds: kind::oriented_box(own, solved),
        })
    }

    /// The longest way on the feature's own surface, the fillets at its foot left out if that shortens it, and whether it
    /// is a closed ring. `own` is that surface as a mesh, or one that stands in for it.
    fn length(
        &self,
        k: u32,
        faces: &[u32],
        (thickness, haste): (f64, bool),
        own: (&[Vec3], &[[u32; 3]]),
        job: &Job,
    ) -> Result<(Option<Length>, bool)> {
        let longest =
            |positions: &[Vec3], triangles: &[[u32; 3]]| match lengths::longest(positions, triangles, haste, job) {
                // a feature without area has no length
                Err(Error::Degenerate(_) | Error::Numeric(_)) => Ok(None),
                other => other,
            };
        let is_ring = |length: &Option<Length>, positions: &[Vec3], triangles: &[[u32; 3]]| match length {
            Some(l) if ring::handles(triangles) > 0 => ring::is_ring(positions, triangles, &l.field),
            _ => false,
        };
        let Skin { positions, triangles, dual, .. } = *self.skin;
        let standing = Standing { positions, triangles, dual, label: self.label, own: k, thickness };
        // what is above its foot, or what stands in for that, and how long it is
        let above = || {
            let Some(above) = standing.above(faces) else { return Ok(None) };
            let above = lengths::extract(positions, triangles, &above)?;
            let above = match lengths::simpler(&above.0, &above.1, job)? {
                Some(simpler) => (simpler.positions, simpler.triangles),
                None => above,
            };
            Ok(longest(&above.0, &above.1)?.map(|length| (length, above)))
        };
        let (whole, above) = rayon::join(|| longest(own.0, own.1), above);
        let whole = whole?;
        if let (Some((length, (positions, triangles))), Some(all)) = (above?, &whole)
            && length.length < all.length
        {
            let length = Some(length);
            let ring = is_ring(&length, &positions, &triangles);
            return Ok((length, ring));
        }
        let ring = is_ring(&whole, own.0, own.1);
        Ok((whole, ring))
    }

    /// D2max and D2min of feature `k` from the places on it, `faces` being its faces.
    pub fn widths(&self, k: u32, mut places: Vec<&Place>, faces: &[u32]) -> Result<(Width, Width)> {
        places.retain(|p| p.width.is_finite());
        let least = quantile(&mut places, 0.0).map_or(Width::NONE, Width::of);
        let own = |p: &&Place| p.facing != NONE && self.label[p.facing as usize] == k;
        let area = |of: &dyn Fn(&&Place) -> bool| places.iter().filter(|p| of(p)).map(|p| p.area).sum::<f64>();
        if area(&own) > OWN * area(&|_| true) {
            places.retain(own);
        }
        let mut most = quantile(&mut places, 1.0).map_or(Width::NONE, Width::of);
        if let [Some(half), Some(typical)] = TYPICAL.map(|q| quantile(&mut places, q)) {
            let limit = typical.width + GROWTH * (typical.width - half.width);
            let limit = plateau(&places).map_or(limit, |w| limit.min(w));
            let within = places.iter().rev().find(|p| p.width <= limit * (1.0 + 1e-9));
            most = within.map_or(most, |p| Width::of(p));
        }
        // --- lower than wide
        if let Some((height, top, foot)) = self.height(k, faces, most.width)? {
            if height < most.width && height >= RELIEF * most.width {
                most = Width { width: height, at: top, contacts: [top, foot] };
            }
        }
        Ok((most, least))
    }

    /// How far the feature rises from the plane that its border lies in, its highest point and the foot of that point;
    /// none if its border lies in no plane, within a share of `width`, or the feature on both sides of it.
    pub fn height(&self, k: u32, faces: &[u32], width: f64) -> Result<Option<(f64, Vec3, Vec3)>> {
        let Skin { positions, triangles, .. } = *self.skin;
        let border = self.largest_border(k, faces)?;
        // --- the plane: its normal is the area vector of the closed border, which points into the feature
        let whole: f64 = border.iter().map(|(a, b)| distance(*a, *b)).sum();
        if !(whole > 0.0) {
            return Ok(None);
        }
        let moment = border.iter().fold([0.0; 3], |m, (a, b)| add(m, scale(add(*a, *b), 0.5 * distance(*a, *b))));
        let centre = scale(moment, 1.0 / whole);
        let vector = area_within(&border, centre);
        let length = norm(vector);
        if !(length > 1e-6 * whole * whole) {
            return Ok(None);
        }
        let up = scale(vector, 1.0 / length);
        let level = |p: Vec3| dot(sub(p, centre), up);
        if border.iter().any(|(a, _)| level(*a).abs() > LEVEL * width) {
            return Ok(None);
        }
        let corner = faces.iter().flat_map(|&f| triangles[f as usize]).map(|v| positions[v as usize]);
        let (mut low, mut top) = (0.0f64, (0.0f64, centre));
        for p in corner {
            let h = level(p);
            low = low.min(h);
            if h > top.0 {
                top = (h, p);
            }
        }
        let one_sided = low >= -LEVEL * width || top.0 <= LEVEL * width;
        if !one_sided {
            return Ok(None);
        }
        let height = top.0.max(-low);
        Ok((top.0 > -low).then(|| (height, top.1, sub(top.1, scale(up, top.0)))))
    }
    /// The sides of the closed border that encloses most.
    fn largest_border(&self, k: u32, faces: &[u32]) -> Result<Vec<(Vec3, Vec3)>> {
        let Skin { positions, triangles, stored, topology, .. } = *self.skin;
        let mut sides: Vec<[u32; 2]> = Vec::new();
        for &f in faces {
            for c in 0..3usize {
                // an edge as stored: the corners may be turned around in `triangles`
                let t = stored[f as usize];
                let (a, b) = (t[c], t[(c + 1) % 3]);
                let around = topology.halfedges(topology.edge_of_halfedge[3 * f as usize + c]);
                if around.len() != 2 || around.iter().any(|h| self.label[*h as usize / 3] != k) {
                    let turned = t != triangles[f as usize];
                    sides.push(if turned { [b, a] } else { [a, b] });
                }
            }
        }
        let mut sets = SparseSets::default();
        sides.iter().for_each(|&[a, b]| sets.join(a, b));
        let mut loops: BTreeMap<u32, Vec<(Vec3, Vec3)>> = BTreeMap::new();
        for [a, b] in sides {
            loops.entry(sets.root(a)).or_default().push((positions[a as usize], positions[b as usize]));
        }
        let size = |l: &Vec<(Vec3, Vec3)>| norm(area_within(l, l[0].0));
        Ok(loops.into_values().max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or_default())
    }
}

/// The upper end of the narrow band of widths that most of the area has, if there is one. `places` by rising width.
pub fn plateau(places: &[&Place]) -> Option<f64> {
    let total: f64 = places.iter().map(|p| p.area).sum();
    let (mut first, mut within, mut best) = (0, 0.0, (MOSTLY * total, None));
    for p in places {
        within += p.area;
        while places[first].width < p.width / (1.0 + EVEN) {
            within -= places[first].area;
            first += 1;
        }
        if within > best.0 {
            best = (within, Some(p.width));
        }
    }
    best.1
}

/// Area vector of what a closed border encloses.
fn area_within(border: &[(Vec3, Vec3)], from: Vec3) -> Vec3 {
    border.iter().fold([0.0; 3], |m, (a, b)| add(m, scale(cross(sub(*a, from), sub(*b, from)), 0.5)))
}

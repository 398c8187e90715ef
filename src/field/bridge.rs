//! From points to vertices: values that a few thousand points of a mesh have are carried over to all its vertices.
//!
//! The points are the vertices of a surface, and a vertex of the mesh takes its value from those around the place on that
//! surface which is nearest to it. It is not far from the place of the vertex of the reference, a mesh of some thousand
//! faces, that the vertex went into, and neither are the points that matter from those around that one.

use crate::error::{Result, try_filled};
use crate::geodesic::Eccentricity;
use crate::job::Job;
use crate::mesh::NONE;
use crate::mesh::measure::{Vec3, at_weights, cross, distance, dot, sub};
use crate::mesh::proxy::{Around, Place, Proxy, faces_near, places};
use crate::mesh::surface::AnalysisSurface;
use rayon::prelude::*;

/// Points that make the value of a place are no further from it than this many spacings.
const NEAR: f64 = 1.5;
/// Points are around a vertex of the reference if they are no further from it than this many spacings.
const AROUND: f64 = 2.5;
/// Points are on one side of a thin wall if the way between them is no longer than so many times their distance.
const DETOUR: f64 = 1.5;
/// Points whose spread in a direction is less than this share of all their spread, squared, tell nothing about it.
const RIDGE: f64 = 1e-4;
/// A point counts up to this many times more than in the mean, or as much less.
const STEEPEST: f64 = 4.0;
/// Vertices in one piece of parallel work at least.
const PIECE: usize = 1 << 13;

/// A mesh, its reference, and the points: the vertices of a surface.
pub(super) struct Bridge<'a> {
    positions: &'a [Vec3],
    reference: &'a Proxy,
    surface: &'a AnalysisSurface,
    around: Around<'a>,
    /// By vertex of the mesh, the face of the surface that it is nearest to; [`NONE`] for one that no face uses.
    face: Vec<u32>,
    /// By vertex of the reference, the points around.
    near: Vec<Vec<u32>>,
}

/// The points that stand for vertices of the mesh: for each its nearest vertex and how far it is off.
pub(super) struct Stands {
    /// A vertex of the mesh; [`NONE`] for a point that stands for none.
    pub vertex: Vec<u32>,
    /// Model units.
    pub off: Vec<f64>,
}

/// The values of a place: distance, its bounds, and the far end.
type Values = ([f64; 3], u32);

/// A point's part in the value of a vertex.
struct Share {
    point: u32,
    /// In the weighted mean.
    weight: f64,
    /// In what the linear function that fits best has at the place of the vertex; may be negative.
    linear: f64,
}

impl<'a> Bridge<'a> {
    /// `onto` are the vertices of `surface` that those of the reference went into.
    ///
    /// # Errors
    /// [`crate::error::Error::NoMemory`], [`crate::error::Error::Cancelled`].
    pub fn new(
        (positions, triangles): (&'a [Vec3], &[[u32; 3]]),
        (reference, onto): (&'a Proxy, &[u32]),
        surface: &'a AnalysisSurface,
        job: &Job,
    ) -> Result<Bridge<'a>> {
        let points = (&surface.positions[..], &surface.triangles[..]);
        let at = places((&reference.positions, &reference.triangles), onto, points, job)?;
        let around = Around::new(points.0, points.1)?;
        let points_near = |(&p, at): (&Vec3, &Place)| {
            let mut near = Vec::new();
            if at.face != NONE {
                around.vertices_near(p, at, AROUND * surface.spacing, |v, _| near.push(v));
            }
            near
        };
        let near = reference.positions.par_iter().zip(&at).map(points_near).collect();
        let face = faces_near((positions, triangles), &reference.onto, &at, points, job)?;
        Ok(Bridge { positions, reference, surface, around, face, near })
    }

    /// The points around the vertex of the reference that vertex `v` of the mesh went into, if that is near enough for all
    /// points that matter for `v` to be among them.
    fn known(&self, v: usize) -> Option<&[u32]> {
        let r = self.reference.onto[v] as usize;
        let away = distance(*self.reference.positions.get(r)?, self.positions[v]);
        (away <= (AROUND - NEAR) * self.surface.spacing && !self.near[r].is_empty()).then(|| &self.near[r][..])
    }

    /// The place on a face of the surface.
    fn place(&self, face: u32, p: Vec3) -> Place {
        Place::nearest((&self.surface.positions, &self.surface.triangles), face, p)
    }

    /// The points that stand for the vertices of the mesh that have their flag set: the nearest corners of the triangles that
    /// these lie on or, where they are far away, the nearest points.
    ///
    /// # Errors
    /// [`crate::error::Error::NoMemory`].
    pub fn stands(&self, wanted: &[bool]) -> Result<Stands> {
        let nearer = |a: (f64, u32), b: (f64, u32)| if b < a { b } else { a };
        let join = |a: ((f64, u32), bool), b: ((f64, u32), bool)| (nearer(a.0, b.0), a.1 | b.1);
        let nearest = |v: usize| {
            let (p, face) = (self.positions[v], self.face[v]);
            let gap = |u: u32| (distance(p, self.surface.positions[u as usize]), u);
            let mut best =
                self.surface.triangles[face as usize].into_iter().map(gap).fold((f64::INFINITY, NONE), nearer);
            if best.0 > self.surface.spacing {
                match self.known(v) {
                    Some(near) => best = near.iter().map(|&u| gap(u)).fold(best, nearer),
                    None => {
                        let place = self.place(face, p);
                        self.around.vertices_near(p, &place, best.0, |u, gap| best = nearer(best, (gap, u)));
                    }
                }
            }
            best
        };
        let count = self.surface.positions.len();
        let all = || {
            let vertices = (0..wanted.len()).into_par_iter().with_min_len(PIECE);
            vertices.filter(|&v| wanted[v] && self.face[v] != NONE)
        };
        // --- the points, and by point the nearest vertex of all
        let none = || vec![((f64::INFINITY, NONE), false); count];
        let found = all().fold(none, |mut found, v| {
            let mut meet = |u: u32| {
                let at = &mut found[u as usize];
                at.0 = nearer(at.0, (distance(self.positions[v], self.surface.positions[u as usize]), v as u32));
            };
            self.known(v).unwrap_or_default().iter().for_each(|&u| meet(u));
            let stand = nearest(v).1;
            if stand != NONE {
                meet(stand);
                found[stand as usize].1 = true;
            }
            found
        });
        let both = |a: Vec<_>, b: Vec<_>| a.into_iter().zip(b).map(|(a, b): (_, _)| join(a, b)).collect();
        let found: Vec<((f64, u32), bool)> = found.reduce(none, both);
        let mut out = Stands { vertex: try_filled(count, NONE, "far ends")?, off: try_filled(count, 0.0, "far ends")? };
        for (u, found) in found.iter().enumerate().filter(|(_, found)| found.1) {
            (out.off[u], out.vertex[u]) = found.0;
        }
        Ok(out)
    }

    /// The points whose values make that of a vertex of the mesh, whose place this is: the corners of its triangle or,
    /// where that is a sliver that reaches farther than its neighbours lie, points near by. Weights add up to 1, the
    /// heaviest is first.
    fn shares(&self, v: usize, place: &Place, d1: &Eccentricity, out: &mut Vec<Share>) {
        let (surface, t) = (self.surface, self.surface.triangles[place.face as usize]);
        out.clear();
        let radius = NEAR * surface.spacing;
        let at = |u: u32| surface.positions[u as usize];
        let p = at_weights(t.map(at), place.weights);
        if (0..3).any(|k| distance(at(t[k]), at(t[(k + 1) % 3])) > radius) {
            // no D1 differs from another by more than the way between them, unless that is round an edge of a thin wall
            let bounds = |u: u32| d1.upper[u as usize] - d1.lower[u as usize];
            let on_one_side = |u: u32| {
                t.iter().all(|&k| {
                    let differ = (d1.distance[u as usize] - d1.distance[k as usize]).abs();
                    differ <= DETOUR * distance(at(u), at(k)) + bounds(u).min(bounds(k))
                })
            };
            let mut take = |point: u32, gap: f64| {
                if on_one_side(point) {
                    let weight = (1.0 - gap / radius).powi(2);
                    out.push(Share { point, weight, linear: weight });
                }
            };
            match self.known(v) {
                Some(near) => {
                    let gaps = near.iter().map(|&u| (u, distance(p, at(u))));
                    gaps.filter(|(_, gap)| *gap <= radius).for_each(|(u, gap)| take(u, gap));
                }
                None => self.around.vertices_near(p, place, radius, take),
            }
        }
        let total: f64 = out.iter().map(|n| n.weight).sum();
        if total > 0.0 {
            out.iter_mut().for_each(|n| n.weight /= total);
            fit(&surface.positions, p, out);
        } else {
            out.clear();
            out.extend(t.into_iter().zip(place.weights).map(|(point, weight)| Share { point, weight, linear: weight }));
        }
        out.sort_unstable_by(|a, b| b.weight.total_cmp(&a.weight).then(a.point.cmp(&b.point)));
    }

    /// The values of all vertices of the mesh from those of the points. A far end is the vertex that `ends` has for it.
    ///
    /// # Errors
    /// [`crate::error::Error::NoMemory`].
    pub fn spread(&self, d1: &Eccentricity, ends: &Stands) -> Result<Eccentricity> {
        let value = |shares: &mut Vec<Share>, v: usize| -> Values {
            if self.face[v] == NONE {
                return ([f64::NAN; 3], NONE);
            }
            self.shares(v, &self.place(self.face[v], self.positions[v]), d1, shares);
            let value: f64 = shares.iter().map(|s| s.linear * d1.distance[s.point as usize]).sum();
            let gap = |values: &[f64]| -> f64 {
                shares.iter().map(|s| s.weight * (values[s.point as usize] - d1.distance[s.point as usize])).sum()
            };
            ([value, value + gap(&d1.lower), value + gap(&d1.upper)], d1.farthest[shares[0].point as usize])
        };
        let n = self.positions.len();
        let filled = || try_filled(n, f64::NAN, "the field");
        let (mut at, mut lower, mut upper) = (filled()?, filled()?, filled()?);
        let mut farthest = try_filled(n, NONE, "the field")?;
        let all = (&mut at, &mut lower, &mut upper, &mut farthest).into_par_iter().enumerate().with_min_len(PIECE);
        all.for_each_init(Vec::new, |shares, (v, (at, lower, upper, farthest))| {
            let (values, end) = value(shares, v);
            [*at, *lower, *upper] = values;
            *farthest = ends.vertex.get(end as usize).copied().unwrap_or(NONE);
        });
        Ok(Eccentricity { distance: at, lower, upper, farthest, longest: d1.longest.clone(), ..*d1 })
    }
}

/// Makes the linear weights of points: those by which the values of the points give the value, at `p`, of the linear
/// function of space that fits them best, by their weights in the mean. A function that is linear on each of up to three
/// planes that meet in a corner, and continuous, is a linear function of space; a mean would be off at every rim, where
/// all points are on one side.
fn fit(positions: &[Vec3], p: Vec3, shares: &mut [Share]) {
    let mut mean = [0.0; 3];
    for s in shares.iter() {
        (0..3).for_each(|k| mean[k] += s.weight * positions[s.point as usize][k]);
    }
    let mut m = [[0.0; 3]; 3];
    for s in shares.iter() {
        let x = sub(positions[s.point as usize], mean);
        for i in 0..3 {
            (0..3).for_each(|j| m[i][j] += s.weight * x[i] * x[j]);
        }
    }
    let trace = m[0][0] + m[1][1] + m[2][2];
    (0..3).for_each(|k| m[k][k] += RIDGE * trace);
    // --- slope = m^-1 (p - mean), by Cramer's rule
    let away = sub(p, mean);
    let rows = [cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1])];
    let det = dot(m[0], rows[0]);
    if !(det > 0.0) {
        return;
    }
    let slope: Vec3 = std::array::from_fn(|k| (0..3).map(|r| rows[r][k] * away[r]).sum::<f64>() / det);
    let tilt = |s: &Share| dot(slope, sub(positions[s.point as usize], mean));
    let most = shares.iter().map(|s| tilt(s).abs()).fold(0.0, f64::max);
    let much = if most > STEEPEST { STEEPEST / most } else { 1.0 };
    for s in shares.iter_mut() {
        s.linear = s.weight * (1.0 + much * tilt(s));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::measure::dot;
    use crate::mesh::shapes::grid_box;
    use crate::mesh::surface::SurfaceOptions;

    #[test]
    fn vertices_get_the_values_of_the_points_around_by_any_reference() {
        let (p, t) = grid_box([4.0, 2.0, 1.0], [60, 40, 20]);
        let job = Job::default();
        // vertices nearer to each other than the points are, and farther apart
        for faces in [4_000, 200] {
            let reference = Proxy::within(&p, &t, faces, 1e-6, &job).unwrap();
            let proxy = Proxy::within(&reference.positions, &reference.triangles, 12, 1e-6, &job).unwrap();
            let options = SurfaceOptions { target_vertices: 600, ..SurfaceOptions::default() };
            let surface = AnalysisSurface::refine(&proxy.positions, &proxy.triangles, &options, &job).unwrap();
            let bridge = Bridge::new((&p, &t), (&reference, &proxy.onto), &surface, &job).unwrap();
            let known = (0..p.len()).filter(|&v| bridge.known(v).is_some()).count();
            assert!((2 * known > p.len()) == (faces == 4_000) && known < p.len(), "{known} of {}", p.len());
            // a value that grows by one a unit of length, and every point its own far end
            let along = |q: &Vec3| dot(*q, [2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0]);
            let told: Vec<f64> = surface.positions.iter().map(along).collect();
            let d1 = Eccentricity {
                distance: told.clone(),
                lower: told.iter().map(|d| d - 1.0).collect(),
                upper: told.iter().map(|d| d + 1.0).collect(),
                farthest: (0..told.len() as u32).collect(),
                solves: 0,
                slack: 0.0,
                missed: 0.0,
                longest: Vec::new(),
            };
            let stands = bridge.stands(&vec![true; p.len()]).unwrap();
            for (&v, (&off, at)) in stands.vertex.iter().zip(stands.off.iter().zip(&surface.positions)) {
                assert!(v == NONE || (off == distance(p[v as usize], *at) && off < surface.spacing), "{off}");
            }
            let points = || (0..told.len()).filter(|&u| stands.vertex[u] != NONE);
            for q in &p {
                let least = points().map(|u| distance(surface.positions[u], *q)).fold(f64::INFINITY, f64::min);
                assert!(least < surface.spacing, "{least}");
            }
            let found = bridge.spread(&d1, &stands).unwrap();
            let (mut worst, mut sum, mut of_means) = (0.0f64, 0.0, 0.0);
            let mut shares = Vec::new();
            for (v, q) in p.iter().enumerate() {
                let off = (found.distance[v] - along(q)).abs();
                worst = worst.max(off / surface.spacing);
                sum += off;
                bridge.shares(v, &bridge.place(bridge.face[v], *q), &d1, &mut shares);
                let mean: f64 = shares.iter().map(|s| s.weight * told[s.point as usize]).sum();
                of_means += (mean - along(q)).abs();
                assert!((found.upper[v] - found.lower[v] - 2.0).abs() < 1e-9);
                let end = found.farthest[v];
                assert!(end == NONE || distance(p[end as usize], *q) < 2.0 * surface.spacing);
            }
            // a linear function comes out as it is, but at rims and corners with few points
            assert!(worst < 0.3 && sum < 0.2 * of_means, "{worst} spacings, {sum} beside {of_means}");
        }
    }
}

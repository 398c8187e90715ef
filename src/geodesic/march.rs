//! Geodesic distance by a front that marches across triangles with its true curvature.
//!
//! Fast marching (Kimmel & Sethian, "Computing geodesic paths on manifolds", PNAS 95 (1998)) carries the front over a
//! triangle as a straight line. Here it is a circle: unfolded into the plane of the triangle, the distances of two
//! vertices fix the point that the front comes from, and the third vertex gets its distance from there (Novotni & Klein,
//! "Computing geodesic distances on triangular meshes", WSCG 2002). On flat faces that is exact, whatever the resolution.
//! Where shortest paths bend round a vertex with more than 360 degrees about it (180 on a boundary), the front starts
//! anew with that vertex as centre: every vertex remembers centre and offset of the front that reached it, as windows do
//! in exact algorithms (Surazhsky et al., SIGGRAPH 2005), but only one of them.
//!
//! What is left of error comes from triangles whose vertices were reached by different fronts; it goes down with the
//! spacing. It needs good triangles, that is an intrinsic Delaunay mesh, but no linear systems and no time step.

use crate::error::{Error, Result, try_filled, try_vec};
use crate::job::Job;
use crate::mesh::NONE;
use crate::mesh::intrinsic::{IntrinsicMesh, double_area, twins};
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::f64::consts::PI;

/// A vertex whose angle exceeds that of the plane by more than this many radians can be the centre of a new front. Less
/// is rounding in the coordinates of a flat face, or bends paths by nothing that matters.
const SADDLE: f64 = 1e-3;

/// A vertex is improved upon when reached by a front shorter by this factor, so that rounding cannot keep it busy.
const SHORTER: f64 = 1.0 - 1e-9;

/// A vertex passes its distance on at most this often; once is the rule, more happens at obtuse triangles.
const MOST_VISITS: u8 = 32;

/// One corner of a triangle, seen from its vertex: the two other vertices and what it takes to cross.
#[derive(Clone, Copy, Default)]
struct Corner {
    /// The other vertices.
    ends: [u32; 2],
    /// Lengths of the sides towards them.
    sides: [f64; 2],
    /// Place of either end when the side to the other one is laid along the x axis, the corner at 0.
    apex: [[f64; 2]; 2],
}

/// The front that reached a vertex: a circle about the vertex `centre`, which itself has the distance `offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Front {
    centre: u32,
    offset: f64,
}

const NO_FRONT: Front = Front { centre: NONE, offset: 0.0 };

/// A surface prepared for marching from any source. Shared by threads; each needs a [`Scratch`] of its own.
#[derive(Debug)]
pub struct MarchSolver {
    start: Vec<u32>,
    corners: Vec<Corner>,
    bends: Vec<bool>,
}

/// Memory of one solving thread.
#[derive(Debug)]
pub struct Scratch {
    distance: Vec<f64>,
    front: Vec<Front>,
    visits: Vec<u8>,
    queue: BinaryHeap<Reverse<(u64, u32)>>,
}

impl std::fmt::Debug for Corner {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?}", self.ends)
    }
}

impl MarchSolver {
    /// Prepares a mesh, best an intrinsic Delaunay one. About 300 bytes a triangle.
    ///
    /// # Errors
    /// [`Error::Argument`] if a corner is not below the vertex count, [`Error::NoMemory`].
    pub fn new(mesh: &IntrinsicMesh) -> Result<MarchSolver> {
        let n = mesh.vertex_count;
        if mesh.triangles.iter().flatten().any(|&v| v as usize >= n) {
            return Err(Error::Argument("a triangle names a vertex that does not exist".into()));
        }
        let mut start = try_filled(n + 1, 0u32, "corners")?;
        for &v in mesh.triangles.iter().flatten() {
            start[v as usize + 1] += 1;
        }
        for v in 0..n {
            start[v + 1] += start[v];
        }
        let mut next = try_vec(n, "corners")?;
        next.extend_from_slice(&start[..n]);
        let mut corners = try_filled(3 * mesh.triangles.len(), Corner::default(), "corners")?;
        for (t, l) in mesh.triangles.iter().zip(&mesh.lengths) {
            for k in 0..3 {
                let slot = &mut next[t[k] as usize];
                corners[*slot as usize] = corner(t, l, k);
                *slot += 1;
            }
        }
        Ok(MarchSolver { start, corners, bends: bends(mesh)? })
    }

    /// Number of vertices of the surface.
    pub fn vertex_count(&self) -> usize {
        self.bends.len()
    }

    /// Memory for [`MarchSolver::distances`].
    ///
    /// # Errors
    /// [`Error::NoMemory`].
    pub fn scratch(&self) -> Result<Scratch> {
        let n = self.vertex_count();
        Ok(Scratch {
            distance: try_filled(n, f64::INFINITY, "distances")?,
            front: try_filled(n, NO_FRONT, "distances")?,
            visits: try_filled(n, 0, "distances")?,
            queue: BinaryHeap::new(),
        })
    }

    /// Distance of every vertex from the nearest of `sources`, in model units; infinite where no path leads. To get
    /// fields of several components at once, give one source of each.
    ///
    /// # Errors
    /// [`Error::Argument`] for a source that is not a vertex, [`Error::Cancelled`].
    pub fn distances<'s>(&self, sources: &[u32], scratch: &'s mut Scratch, job: &Job) -> Result<&'s [f64]> {
        scratch.distance.fill(f64::INFINITY);
        scratch.front.fill(NO_FRONT);
        scratch.visits.fill(0);
        scratch.queue.clear();
        for &s in sources {
            let Some(distance) = scratch.distance.get_mut(s as usize) else {
                return Err(Error::Argument(format!("source {s} is not a vertex")));
            };
            *distance = 0.0;
            scratch.front[s as usize] = Front { centre: s, offset: 0.0 };
            scratch.queue.push(Reverse((0, s)));
        }
        let mut steps = 0u32;
        while let Some(Reverse((key, v))) = scratch.queue.pop() {
            let v = v as usize;
            // Outdated entries stay in the queue. Distances are not negative: their bits sort as they do.
            if scratch.distance[v].to_bits() != key || scratch.visits[v] == MOST_VISITS {
                continue;
            }
            scratch.visits[v] += 1;
            steps += 1;
            if steps % 4096 == 0 {
                job.check()?;
            }
            for corner in &self.corners[self.start[v] as usize..self.start[v + 1] as usize] {
                self.cross(v, corner, 0, scratch);
                self.cross(v, corner, 1, scratch);
            }
        }
        Ok(&scratch.distance)
    }

    /// Offers `corner.ends[k]` its distance along the side from `v` and across the triangle from `v` and the other end.
    fn cross(&self, v: usize, corner: &Corner, k: usize, scratch: &mut Scratch) {
        let (target, other) = (corner.ends[k] as usize, corner.ends[1 - k] as usize);
        let (at_v, at_other) = (scratch.distance[v], scratch.distance[other]);
        // No path across the base can be shorter than the base's nearest point and the way from there.
        if scratch.distance[target] <= at_v.min((at_v + at_other - corner.sides[1 - k]) / 2.0 + corner.apex[k][1]) {
            return;
        }
        let old = scratch.front[v];

        // --- along the side; v is a centre from here on if paths can bend there
        let mut best = at_v + corner.sides[k];
        let mut front = if self.bends[v] { Front { centre: v as u32, offset: at_v } } else { old };

        // --- across the base from v to the other end
        if at_other < f64::INFINITY {
            let (theirs, base) = (scratch.front[other], corner.sides[1 - k]);
            let through = |front: Front| {
                front.offset + circle(base, at_v - front.offset, at_other - front.offset, corner.apex[k])
            };
            let (distance, by) = if old.centre == theirs.centre || old.centre == other as u32 {
                (through(old), old)
            } else if theirs.centre == v as u32 {
                (through(theirs), theirs)
            } else {
                // Two fronts meet: take the distances for those of one front, from as far back as the older of them.
                let offset = old.offset.min(theirs.offset);
                (through(Front { offset, ..old }), if at_v < at_other { old } else { theirs })
            };
            if distance < best {
                (best, front) = (distance, by);
            }
        }
        if best < scratch.distance[target] * SHORTER {
            scratch.distance[target] = best;
            scratch.front[target] = front;
            scratch.queue.push(Reverse((best.to_bits(), target as u32)));
        }
    }
}

/// Distance of the point `apex` (y >= 0) from the point below the x axis that is `from_start` away from the origin and
/// `from_end` from (base, 0); infinite if there is none, or if the straight line does not cross the base.
fn circle(base: f64, from_start: f64, from_end: f64, apex: [f64; 2]) -> f64 {
    let x = (base * base + (from_start - from_end) * (from_start + from_end)) / (2.0 * base);
    let square = from_start * from_start - x * x;
    // Both distances along the base itself (the front moves along it) leave a rounding error here.
    if !(square >= -1e-12 * base * base) {
        return f64::INFINITY;
    }
    let y = square.max(0.0).sqrt();
    let across = x * apex[1] + apex[0] * y;
    if across < 0.0 || across > base * (y + apex[1]) {
        return f64::INFINITY;
    }
    let (dx, dy) = (apex[0] - x, apex[1] + y);
    (dx * dx + dy * dy).sqrt()
}

fn corner(t: &[u32; 3], l: &[f64; 3], k: usize) -> Corner {
    let (i, j) = ((k + 1) % 3, (k + 2) % 3);
    let sides = [l[k], l[j]];
    let area = double_area(*l);
    // Along either side: (adjacent² + side² - opposite²) / (2 side); across: twice the area over the side.
    let along = |side: f64, adjacent: f64| (side * side + (adjacent - l[i]) * (adjacent + l[i])) / (2.0 * side);
    let apex = [[along(sides[1], sides[0]), area / sides[1]], [along(sides[0], sides[1]), area / sides[0]]];
    Corner { ends: [t[i], t[j]], sides, apex }
}

/// Vertices that shortest paths can bend at: more angle about them than in the plane, or in a half-plane where open or
/// non-manifold edges end.
fn bends(mesh: &IntrinsicMesh) -> Result<Vec<bool>> {
    let mut angle = try_filled(mesh.vertex_count, 0.0, "angles")?;
    for (t, l) in mesh.triangles.iter().zip(&mesh.lengths) {
        for k in 0..3 {
            let (a, b, c) = (l[k], l[(k + 2) % 3], l[(k + 1) % 3]);
            angle[t[k] as usize] += double_area(*l).atan2((a * a + (b - c) * (b + c)) / 2.0);
        }
    }
    let twin = twins(mesh.vertex_count, &mesh.triangles, Some(&mesh.lengths))?;
    let mut flat = try_filled(mesh.vertex_count, 2.0 * PI, "angles")?;
    for (f, t) in mesh.triangles.iter().enumerate() {
        for k in (0..3).filter(|k| twin[3 * f + k] == NONE) {
            flat[t[k] as usize] = PI;
            flat[t[(k + 1) % 3] as usize] = PI;
        }
    }
    Ok(angle.iter().zip(&flat).map(|(angle, flat)| *angle > flat + SADDLE).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::CancelToken;
    use crate::mesh::measure::{Vec3, distance, norm};
    use crate::mesh::shapes;
    use crate::mesh::surface::{AnalysisSurface, SurfaceOptions};

    fn job() -> Job {
        Job::new(1, None, CancelToken::default())
    }

    /// The refined surface's positions and its solver.
    fn prepare(p: &[Vec3], t: &[[u32; 3]], vertices: usize) -> (Vec<Vec3>, MarchSolver) {
        let options = SurfaceOptions { target_vertices: vertices, ..SurfaceOptions::default() };
        let surface = AnalysisSurface::refine(p, t, &options, &job()).unwrap();
        let solver = MarchSolver::new(&surface.intrinsic(&job()).unwrap()).unwrap();
        (surface.positions, solver)
    }

    fn field(solver: &MarchSolver, source: u32) -> Vec<f64> {
        solver.distances(&[source], &mut solver.scratch().unwrap(), &job()).unwrap().to_vec()
    }

    #[test]
    fn exact_in_a_convex_plane() {
        let p = [[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [3.0, 2.0, 0.0], [0.0, 2.0, 0.0]];
        let (positions, solver) = prepare(&p, &[[0, 1, 2], [0, 2, 3]], 1000);
        for source in [0, 100, 500] {
            for (p, d) in positions.iter().zip(field(&solver, source)) {
                let exact = distance(*p, positions[source as usize]);
                assert!((d - exact).abs() < 1e-9 * 3.0, "{d} {exact}");
            }
        }
    }

    #[test]
    fn exact_round_a_reflex_corner() {
        // An L of six unit half-squares; its inner corner at (1, 1).
        let p = [[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, 2.0, 0.0]];
        let p: Vec<Vec3> = p.into_iter().chain([[0.0, 2.0, 0.0], [0.0, 1.0, 0.0]]).collect();
        let t = [[0, 1, 4], [0, 4, 7], [1, 2, 3], [1, 3, 4], [7, 4, 5], [7, 5, 6]];
        let (positions, solver) = prepare(&p, &t, 2000);
        let d = field(&solver, 2);
        // From (2, 0) the corner (1, 2) is seen past (1, 1): straight to it and on.
        let corner = [1.0, 1.0, 0.0];
        for (q, d) in positions.iter().zip(&d) {
            let shadow = q[0] + q[1] > 2.0 && q[1] > 1.0;
            let direct = distance(*q, p[2]);
            let exact = if shadow { distance(p[2], corner) + distance(corner, *q) } else { direct };
            assert!((d - exact).abs() < 0.006 * exact.max(0.1), "{q:?}: {d} {exact}");
        }
        assert!((d[5] - 1.0 - 2f64.sqrt()).abs() < 1e-3);
    }

    #[test]
    fn opposite_corners_of_a_cube_and_poles_of_a_sphere() {
        let (p, t) = shapes::cuboid([1.0; 3]);
        let (_, solver) = prepare(&p, &t, 2000);
        let far = (0..8).max_by(|&a, &b| distance(p[0], p[a]).total_cmp(&distance(p[0], p[b]))).unwrap();
        assert!((field(&solver, 0)[far] / 5f64.sqrt() - 1.0).abs() < 0.005, "{}", field(&solver, 0)[far]);

        // Curvature everywhere is the worst case: no face is flat for longer than a step. First order in the spacing.
        let errors = [4, 5].map(|level| {
            let (p, t) = shapes::icosphere(level);
            let solver = MarchSolver::new(&IntrinsicMesh::from_extrinsic(&p, &t).unwrap()).unwrap();
            let radius = norm(p[0]);
            let exact = p.iter().map(|q| {
                let cosine = (0..3).map(|k| q[k] * p[0][k]).sum::<f64>() / (radius * radius);
                radius * cosine.clamp(-1.0, 1.0).acos()
            });
            let error = |(exact, d): (f64, f64)| (d - exact).abs() / exact.max(0.1);
            exact.zip(field(&solver, 0)).map(error).fold(0.0, f64::max)
        });
        assert!(errors[0] < 0.02 && errors[1] < 0.7 * errors[0], "{errors:?}");
    }

    #[test]
    fn unreached_components_are_infinite_and_sources_may_be_many() {
        let (a, t) = shapes::cuboid([1.0; 3]);
        let (p, t) = shapes::union(&[(a.clone(), t.clone()), (shapes::translated(a, [5.0, 0.0, 0.0]), t)]);
        let solver = MarchSolver::new(&IntrinsicMesh::from_extrinsic(&p, &t).unwrap()).unwrap();
        let one = field(&solver, 0);
        assert!(one[..8].iter().all(|d| *d < 3.0) && one[8..].iter().all(|d| d.is_infinite()));
        let mut scratch = solver.scratch().unwrap();
        let both = solver.distances(&[0, 8], &mut scratch, &job()).unwrap();
        assert_eq!(&both[..8], &one[..8]);
        assert_eq!(&both[8..], &one[..8]);
        assert!(matches!(solver.distances(&[99], &mut scratch, &job()), Err(Error::Argument(_))));
    }

    #[test]
    fn nonsense_lengths_end() {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 33) as f64 / (1u64 << 31) as f64
        };
        let lengths = (0..3000).map(|_| [0; 3].map(|_| random().powi(4))).collect();
        let triangles = (0..3000).map(|_| [0; 3].map(|_| (500.0 * random()) as u32)).collect();
        let mesh = IntrinsicMesh { vertex_count: 500, triangles, lengths };
        let solver = MarchSolver::new(&mesh).unwrap();
        assert!(field(&solver, 3).iter().all(|d| *d >= 0.0));
        let zero = IntrinsicMesh { lengths: vec![[0.0; 3]; mesh.triangles.len()], ..mesh };
        assert!(field(&MarchSolver::new(&zero).unwrap(), 3).iter().all(|d| *d >= 0.0));
    }
}

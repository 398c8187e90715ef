//! A mesh of fewer faces that stands in for another, and where the other's vertices lie on it.
//!
//! D1 is a length across the whole part: it hardly changes when threads of a hole and facets of a fillet are cut down to
//! a few triangles, while the work does. The place of a vertex is looked for from the vertex that it went into, from
//! triangle to neighbouring triangle, and so never ends up on the other side of a thin wall.

use super::NONE;
use super::around::VertexFaces;
use super::measure::{Vec3, bounding_box, corners, distance};
use super::simplify::{Simplified, SimplifyOptions, nearest_in_triangle, simplify};
use super::used::Used;
use crate::error::{Result, try_filled};
use crate::job::Job;
use rayon::prelude::*;

/// Steps from triangle to triangle at most, on the way to the nearest.
const STEPS: usize = 64;

/// Faces that are looked at for the vertices near a place.
const SEEN: usize = 128;

/// A reference is taken down to this many faces ...
pub const REFERENCE_FACES: usize = 16_000;
/// ... but may have so many if it has to, to stay where it was.
pub const REFERENCE_LIMIT: usize = 60_000;
/// Its distance from the mesh, as a share of the mesh's size: the first that is coarse enough is taken.
const REFERENCE_SHARES: [f64; 3] = [2e-4, 1e-3, 5e-3];

/// A point of a triangle mesh: a face and barycentric coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Index of the face; [`NONE`] for a vertex that no face used.
    pub face: u32,
    /// Barycentric coordinates, in the order of the face's corners.
    pub weights: [f64; 3],
}

/// The mesh that stands in.
#[derive(Debug, Clone, PartialEq)]
pub struct Proxy {
    /// Positions of its vertices, some of the original's.
    pub positions: Vec<Vec3>,
    /// Its triangles.
    pub triangles: Vec<[u32; 3]>,
    /// For each of its vertices that of the original.
    pub original: Vec<u32>,
    /// For each vertex of the original the vertex of this mesh that it went into; [`NONE`] if no face used it.
    pub onto: Vec<u32>,
}

impl Proxy {
    /// Simplifies a mesh; see [`simplify`].
    ///
    /// # Errors
    /// Those of [`simplify`].
    pub fn new(positions: &[Vec3], triangles: &[[u32; 3]], options: &SimplifyOptions, job: &Job) -> Result<Proxy> {
        let Simplified { triangles, onto } = simplify(positions, triangles, options, job)?;
        let used = Used::new(positions.len(), triangles.iter().copied(), "proxy")?;
        Ok(Proxy {
            positions: used.vertices.iter().map(|&v| positions[v as usize]).collect(),
            triangles: triangles.iter().map(|t| used.triangle(*t)).collect(),
            onto: onto.iter().map(|&v| used.number[v as usize]).collect(),
            original: used.vertices,
        })
    }

    /// The mesh with few faces, at least `faces`, within `share` of its size of where it was.
    ///
    /// # Errors
    /// Those of [`simplify`].
    pub fn within(positions: &[Vec3], triangles: &[[u32; 3]], faces: usize, share: f64, job: &Job) -> Result<Proxy> {
        let (lo, hi) = bounding_box(triangles.iter().flatten().map(|&v| positions[v as usize]));
        let options = SimplifyOptions { target_faces: faces, max_error: share * distance(lo, hi) };
        Proxy::new(positions, triangles, &options, job)
    }

    /// The mesh with few enough faces for some exact distance fields and no further from it than must be; none if it does
    /// not become so simple.
    ///
    /// # Errors
    /// Those of [`simplify`].
    pub fn reference(positions: &[Vec3], triangles: &[[u32; 3]], job: &Job) -> Result<Option<Proxy>> {
        for share in REFERENCE_SHARES {
            let proxy = Proxy::within(positions, triangles, REFERENCE_FACES, share, job)?;
            if proxy.triangles.len() <= REFERENCE_LIMIT {
                return Ok(Some(proxy));
            }
        }
        Ok(None)
    }
}

impl Place {
    /// The point of `face` that is nearest to `p`; a corner of it with a weight of exactly 1 if that is the same point.
    pub fn nearest((positions, triangles): (&[Vec3], &[[u32; 3]]), face: u32, p: Vec3) -> Place {
        let corners = corners(positions, triangles[face as usize]);
        let weights = match corners.iter().position(|c| *c == p) {
            Some(k) => std::array::from_fn(|c| f64::from(u8::from(c == k))),
            None => nearest_in_triangle(corners, p).0,
        };
        Place { face, weights }
    }
}

/// For every one of `points`, the vertices of a mesh of `faces`, its nearest place on another mesh as far as a walk from
/// vertex `from[i]` of that one finds it, or from the places of the point's neighbours.
///
/// # Errors
/// [`crate::error::Error::NoMemory`], [`crate::error::Error::Cancelled`].
pub fn places(
    points: (&[Vec3], &[[u32; 3]]),
    from: &[u32],
    mesh: (&[Vec3], &[[u32; 3]]),
    job: &Job,
) -> Result<Vec<Place>> {
    let mut out = try_filled(points.0.len(), Place { face: NONE, weights: [0.0; 3] }, "places")?;
    let faces = nearest_faces(points, from, mesh, job)?;
    out.par_iter_mut().zip(points.0).zip(faces).filter(|(_, face)| *face != NONE).for_each(|((place, &p), face)| {
        *place = Place::nearest(mesh, face, p);
    });
    Ok(out)
}

/// The faces of the [`places`]; [`NONE`] for a point that no face uses.
fn nearest_faces(
    points: (&[Vec3], &[[u32; 3]]),
    from: &[u32],
    (positions, triangles): (&[Vec3], &[[u32; 3]]),
    job: &Job,
) -> Result<Vec<u32>> {
    let around = Around::new(positions, triangles)?;
    around.settle(points, |v| around.walk_from(points.0[v], from[v]), job)
}

/// For every one of `points`, the vertices of a mesh of `faces`, the face of another mesh that it is nearest to, as far as a
/// walk from the place `at[near[i]]` finds it; [`NONE`] for a point that no face uses.
///
/// # Errors
/// Those of [`places`].
pub fn faces_near(
    points: (&[Vec3], &[[u32; 3]]),
    near: &[u32],
    at: &[Place],
    (positions, triangles): (&[Vec3], &[[u32; 3]]),
    job: &Job,
) -> Result<Vec<u32>> {
    let around = Around::new(positions, triangles)?;
    let first = |v: usize| {
        let mut best = (NONE, f64::INFINITY);
        if let Some(face) = at.get(near[v] as usize).map(|at| at.face).filter(|face| *face != NONE) {
            around.look(&mut best, points.0[v], face);
        }
        around.walk(points.0[v], best)
    };
    around.settle(points, first, job)
}

/// A mesh and the faces around each of its vertices.
pub struct Around<'a> {
    positions: &'a [Vec3],
    triangles: &'a [[u32; 3]],
    faces: VertexFaces,
}

impl Around<'_> {
    /// Sorts the faces by vertex.
    ///
    /// # Errors
    /// [`crate::error::Error::NoMemory`].
    pub fn new<'a>(positions: &'a [Vec3], triangles: &'a [[u32; 3]]) -> Result<Around<'a>> {
        Ok(Around { positions, triangles, faces: VertexFaces::new(positions.len(), triangles)? })
    }

    /// Calls `take` with the vertices within `radius` of the place of `p`, each with its distance, as far as a walk over
    /// faces within that radius finds them; no more than [`SEEN`] faces.
    pub fn vertices_near(&self, p: Vec3, at: &Place, radius: f64, mut take: impl FnMut(u32, f64)) {
        let (mut faces, mut vertices) = (vec![at.face], Vec::new());
        let mut next = 0;
        while next < faces.len() {
            for v in self.triangles[faces[next] as usize] {
                if vertices.contains(&v) {
                    continue;
                }
                vertices.push(v);
                let gap = distance(self.positions[v as usize], p);
                if gap <= radius {
                    take(v, gap);
                }
                for &f in self.faces.of(v) {
                    let within = || nearest_in_triangle(corners(self.positions, self.triangles[f as usize]), p).1;
                    if faces.len() < SEEN && !faces.contains(&f) && within() <= radius * radius {
                        faces.push(f);
                    }
                }
            }
            next += 1;
        }
    }

    /// The nearest face to each of some points: the `first`, with its squared distance, or one that neighbours in `faces` of
    /// the points lead to.
    fn settle(
        &self,
        (points, faces): (&[Vec3], &[[u32; 3]]),
        first: impl Fn(usize) -> (u32, f64) + Sync,
        job: &Job,
    ) -> Result<Vec<u32>> {
        job.check()?;
        let mut face = try_filled(points.len(), NONE, "places")?;
        let mut squared = try_filled(points.len(), f64::INFINITY, "places")?;
        (&mut face, &mut squared).into_par_iter().enumerate().for_each(|(v, (face, squared))| {
            (*face, *squared) = first(v);
        });
        job.check()?;
        // A walk can end in a hollow; neighbours that came out of it, or never were in it, show the way.
        for &t in faces {
            let [a, b, c] = t.map(|v| face[v as usize]);
            if a == b && b == c {
                continue;
            }
            for (v, by) in [(0, 1), (1, 2), (2, 0), (1, 0), (2, 1), (0, 2)] {
                let (v, by) = (t[v] as usize, t[by] as usize);
                if squared[v] > 0.0 && face[by] != NONE && face[by] != face[v] {
                    let mut best = (face[v], squared[v]);
                    self.look(&mut best, points[v], face[by]);
                    if best.1 < squared[v] {
                        (face[v], squared[v]) = self.walk(points[v], best);
                    }
                }
            }
        }
        job.check()?;
        Ok(face)
    }

    /// Takes `face` if it is nearer to `p` than `best`, which comes with its squared distance.
    fn look(&self, best: &mut (u32, f64), p: Vec3, face: u32) {
        let squared = nearest_in_triangle(corners(self.positions, self.triangles[face as usize]), p).1;
        if squared < best.1 {
            *best = (face, squared);
        }
    }

    fn walk_from(&self, p: Vec3, start: u32) -> (u32, f64) {
        let mut best = (NONE, f64::INFINITY);
        if start == NONE {
            return best;
        }
        if let (true, Some(&face)) = (self.positions[start as usize] == p, self.faces.of(start).first()) {
            return (face, 0.0);
        }
        self.faces.of(start).iter().for_each(|&f| self.look(&mut best, p, f));
        self.walk(p, best)
    }

    /// From face to neighbouring face as long as that gets nearer.
    fn walk(&self, p: Vec3, mut best: (u32, f64)) -> (u32, f64) {
        // vertices whose faces were all looked at
        let (mut done, mut count) = ([NONE; 16], 0);
        let mut from = NONE;
        for _ in 0..STEPS {
            if best.0 == from || best.0 == NONE {
                break;
            }
            from = best.0;
            for v in self.triangles[from as usize] {
                if !done.contains(&v) {
                    self.faces.of(v).iter().for_each(|&f| self.look(&mut best, p, f));
                    done[count % done.len()] = v;
                    count += 1;
                }
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::measure::{at_weights, norm};
    use crate::mesh::shapes::{grid_box, icosphere};

    fn proxy(shape: &(Vec<Vec3>, Vec<[u32; 3]>), faces: usize, error: f64) -> Proxy {
        let options = SimplifyOptions { target_faces: faces, max_error: error };
        Proxy::new(&shape.0, &shape.1, &options, &Job::default()).unwrap()
    }

    fn on(proxy: &Proxy, place: &Place) -> Vec3 {
        at_weights(corners(&proxy.positions, proxy.triangles[place.face as usize]), place.weights)
    }

    #[test]
    fn a_box_comes_down_to_twelve_triangles_and_its_vertices_stay_in_place() {
        let shape = grid_box([4.0, 2.0, 1.0], [16, 8, 4]);
        let small = proxy(&shape, 0, 1e-6);
        assert_eq!((small.positions.len(), small.triangles.len()), (8, 12));
        let places = places((&shape.0, &shape.1), &small.onto, (&small.positions, &small.triangles), &Job::default());
        for (p, place) in shape.0.iter().zip(places.unwrap()) {
            assert!(distance(*p, on(&small, &place)) < 1e-9);
        }
    }

    #[test]
    fn a_sphere_keeps_its_topology_and_its_distance() {
        let shape = icosphere(5);
        let small = proxy(&shape, 500, 0.1);
        assert!(small.triangles.len() <= 510 && small.triangles.len() >= 490, "{}", small.triangles.len());
        assert_eq!(small.triangles.len(), 2 * small.positions.len() - 4, "still a sphere");
        let places =
            places((&shape.0, &shape.1), &small.onto, (&small.positions, &small.triangles), &Job::default()).unwrap();
        for (p, place) in shape.0.iter().zip(&places) {
            // edges of about 0.24, up to twice that where they are uneven: 0.48^2 / 6 below the sphere at most
            assert!(distance(*p, on(&small, place)) < 0.04, "{}", distance(*p, on(&small, place)));
            assert!(norm(*p) > 0.99);
        }
    }

    #[test]
    fn open_and_non_manifold_edges_stay() {
        // an open grid, and a fin on it that makes a row of edges non-manifold
        let (mut p, mut t) = (Vec::new(), Vec::new());
        for i in 0..11 {
            for j in 0..11 {
                p.push([i as f64, j as f64, 0.0]);
            }
        }
        for i in 0..10 {
            for j in 0..10 {
                let v = 11 * i + j;
                t.extend([[v, v + 11, v + 1], [v + 1, v + 11, v + 12]]);
            }
        }
        for j in 0..10 {
            p.push([5.0, j as f64 + 0.5, 1.0]);
            t.push([55 + j, 56 + j, p.len() as u32 - 1]);
        }
        let area =
            |p: &[Vec3], t: &[[u32; 3]]| -> f64 { t.iter().map(|t| crate::mesh::measure::area(corners(p, *t))).sum() };
        let whole = area(&p, &t);
        let small = proxy(&(p, t), 0, 1e-9);
        assert!(small.triangles.len() < 60, "{}", small.triangles.len());
        assert!((area(&small.positions, &small.triangles) - whole).abs() < 1e-9, "nothing lost, nothing folded");
    }
}

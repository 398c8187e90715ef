//! A mesh of fewer faces that stands in for another, and where the other's vertices lie on it.
//!
//! D1 is a length across the whole part: it hardly changes when threads of a hole and facets of a fillet are cut down to
//! a few triangles, while the work does. The place of a vertex is looked for from the vertex that it went into, from
//! triangle to neighbouring triangle, and so never ends up on the other side of a thin wall.

use super::NONE;
use super::around::VertexFaces;
use super::measure::{Vec3, corners, distance};
use super::simplify::{Simplified, SimplifyOptions, nearest_in_triangle, simplify};
use crate::error::{Result, try_filled};
use crate::job::Job;
use rayon::prelude::*;

/// Steps from triangle to triangle at most, on the way to the nearest.
const STEPS: usize = 64;

/// Faces that are looked at for the vertices near a place.
const SEEN: usize = 128;

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
        let mut number = try_filled(positions.len(), NONE, "proxy")?;
        let mut original = Vec::new();
        let mut used = try_filled(positions.len(), false, "proxy")?;
        triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
        for v in (0..positions.len() as u32).filter(|&v| used[v as usize]) {
            number[v as usize] = original.len() as u32;
            original.push(v);
        }
        Ok(Proxy {
            positions: original.iter().map(|&v| positions[v as usize]).collect(),
            triangles: triangles.iter().map(|t| t.map(|v| number[v as usize])).collect(),
            onto: onto.iter().map(|&v| number[v as usize]).collect(),
            original,
        })
    }
}

/// For every one of `points`, the vertices of a mesh of `faces`, its nearest place on another mesh as far as a walk from
/// vertex `from[i]` of that one finds it, or from the places of the point's neighbours.
///
/// # Errors
/// [`crate::error::Error::NoMemory`], [`crate::error::Error::Cancelled`].
pub fn places(
    (points, faces): (&[Vec3], &[[u32; 3]]),
    from: &[u32],
    (positions, triangles): (&[Vec3], &[[u32; 3]]),
    job: &Job,
) -> Result<Vec<Place>> {
    let around = Around::new(positions, triangles)?;
    job.check()?;
    let mut out: Vec<(Place, f64)> =
        points.par_iter().zip(from).map(|(&p, &start)| around.walk_from(p, start)).collect();
    // A walk can end in a hollow; neighbours that came out of it, or never were in it, show the way.
    for &t in faces {
        for (v, by) in [(0, 1), (1, 2), (2, 0), (1, 0), (2, 1), (0, 2)].map(|(v, by)| (t[v] as usize, t[by] as usize)) {
            let face = out[by].0.face;
            if out[v].1 > 0.0 && face != NONE && face != out[v].0.face {
                let mut best = out[v];
                around.look(&mut best, points[v], face);
                if best.1 < out[v].1 {
                    out[v] = around.walk(points[v], best);
                }
            }
        }
    }
    job.check()?;
    Ok(out.into_iter().map(|(place, _)| place).collect())
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

    /// Takes the point of `face` nearest to `p` if it is nearer than `best`, which comes with its squared distance.
    fn look(&self, best: &mut (Place, f64), p: Vec3, face: u32) {
        let (weights, squared) = nearest_in_triangle(corners(self.positions, self.triangles[face as usize]), p);
        if squared < best.1 {
            *best = (Place { face, weights }, squared);
        }
    }

    fn walk_from(&self, p: Vec3, start: u32) -> (Place, f64) {
        let mut best = (Place { face: NONE, weights: [0.0; 3] }, f64::INFINITY);
        if start == NONE {
            return best;
        }
        if let (true, Some(&face)) = (self.positions[start as usize] == p, self.faces.of(start).first()) {
            let weights = self.triangles[face as usize].map(|v| f64::from(u8::from(v == start)));
            return (Place { face, weights }, 0.0);
        }
        self.faces.of(start).iter().for_each(|&f| self.look(&mut best, p, f));
        self.walk(p, best)
    }

    /// From face to neighbouring face as long as that gets nearer.
    fn walk(&self, p: Vec3, mut best: (Place, f64)) -> (Place, f64) {
        let mut from = NONE;
        for _ in 0..STEPS {
            if best.0.face == from || best.0.face == NONE {
                break;
            }
            from = best.0.face;
            for v in self.triangles[from as usize] {
                self.faces.of(v).iter().for_each(|&f| self.look(&mut best, p, f));
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

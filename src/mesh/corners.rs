//! Which vertices the shape itself has, whatever its triangulation.

use super::measure::{Vec3, area_vector, corners, cross, dot, is_flat, norm, scale};
use crate::error::{Result, try_filled, try_vec};

/// Planes whose normals are closer than this, radians, are one plane: above the noise of float32 coordinates, below the
/// facets of any tessellation that is used for printing.
const SAME_PLANE: f64 = 1e-3;

/// True for the vertices in which three or more planes meet. The others lie inside a flat face or on a straight edge: a
/// subdivision or another triangulation of the same shape puts them elsewhere, so farthest points are not sought there.
/// `triangles` may hold triangles without area, which count for nothing. O(faces × planes a vertex), the latter at most 3.
pub fn shape_corners(positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<Vec<bool>> {
    // by vertex: up to two normals seen so far
    let mut seen: Vec<[Vec3; 2]> = try_filled(positions.len(), [[0.0; 3]; 2], "corners")?;
    let mut count: Vec<u8> = try_filled(positions.len(), 0, "corners")?;
    for &t in triangles {
        let points = corners(positions, t);
        if is_flat(points) {
            continue;
        }
        let n = area_vector(points);
        let n = scale(n, 1.0 / norm(n));
        for v in t.map(|v| v as usize) {
            let known = count[v] as usize;
            let same = |m: &Vec3| dot(*m, n) > 0.0 && norm(cross(*m, n)) < SAME_PLANE;
            if known < 3 && !seen[v][..known.min(2)].iter().any(same) {
                if known < 2 {
                    seen[v][known] = n;
                }
                count[v] += 1;
            }
        }
    }
    let mut out = try_vec(count.len(), "corners")?;
    out.extend(count.iter().map(|&c| c > 2));
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes::{cuboid, grid_box, icosphere, split_in_four};

    #[test]
    fn a_box_has_eight_corners_however_finely_it_is_cut() {
        for (p, t) in [cuboid([1.0, 2.0, 3.0]), grid_box([1.0, 2.0, 3.0], [3, 4, 5])] {
            let corner = shape_corners(&p, &t).unwrap();
            assert_eq!(corner.iter().filter(|c| **c).count(), 8);
            assert!(p.iter().zip(&corner).all(|(q, c)| *c == (0..3).all(|k| q[k] == 0.0 || q[k] == (k + 1) as f64)));
        }
    }

    #[test]
    fn a_subdivided_polyhedron_keeps_its_corners() {
        let (p, t) = icosphere(3);
        assert!(shape_corners(&p, &t).unwrap().iter().all(|c| *c));
        let (q, u) = split_in_four(&p, &t);
        let corner = shape_corners(&q, &u).unwrap();
        assert!(corner[..p.len()].iter().all(|c| *c) && corner[p.len()..].iter().all(|c| !c));
    }
}

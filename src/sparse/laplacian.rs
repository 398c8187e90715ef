//! The cotangent Laplacian of a surface known by its edge lengths (Eqs. 4 and 5).
//!
//! Sign: here `L` is positive semi-definite, the negative of the paper's `L_C`.

use super::SymmetricMatrix;
use crate::error::{Result, try_filled, try_vec};
use crate::mesh::intrinsic::IntrinsicMesh;
use std::sync::Arc;

/// A triangle as the discrete operators see it.
#[derive(Debug, Clone, Copy)]
pub struct Triangle {
    /// Corners.
    pub vertices: [u32; 3],
    /// Half the cotangent of the angle at each corner: the weight of the opposite edge.
    pub weight: [f64; 3],
    /// Area, model units squared.
    pub area: f64,
}

impl Triangle {
    /// From edge lengths; `lengths[k]` joins corners k and k + 1. Needs the strict triangle inequality.
    pub fn new(vertices: [u32; 3], lengths: [f64; 3]) -> Triangle {
        let area = heron(lengths);
        // cot at corner k = (sum of the squares of the sides there - square of the opposite side) / (4 area)
        let square = lengths.map(|l| l * l);
        let weight = [0, 1, 2].map(|k| (square[k] + square[(k + 2) % 3] - square[(k + 1) % 3]) / (8.0 * area));
        Triangle { vertices, weight, area }
    }

    /// Corner values of the local Dirichlet operator: (L_f u)_i = A_f ∇u · ∇φ_i, by differences so that adding a
    /// constant to u changes nothing.
    #[inline(always)]
    pub fn stiffness(&self, u: [f64; 3]) -> [f64; 3] {
        // flux over the edge opposite corner k
        let [p, q, r] = self.weight;
        let flux = [p * (u[1] - u[2]), q * (u[2] - u[0]), r * (u[0] - u[1])];
        [flux[2] - flux[1], flux[0] - flux[2], flux[1] - flux[0]]
    }
}

/// Area by Heron's formula in Kahan's stable form.
pub fn heron(lengths: [f64; 3]) -> f64 {
    let mut l = lengths;
    l.sort_unstable_by(|p, q| q.total_cmp(p));
    let [a, b, c] = l;
    let product = (a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c));
    0.25 * product.max(0.0).sqrt()
}

/// Mass and stiffness of a surface.
#[derive(Debug)]
pub struct Laplacian {
    /// The triangles.
    pub triangles: Vec<Triangle>,
    /// Lumped mass: a third of the area around every vertex.
    pub mass: Vec<f64>,
    columns: Arc<[u32]>,
    rows: Arc<[u32]>,
    stiffness: Vec<f64>,
}

impl Laplacian {
    /// Assembles the operators in O(triangles).
    pub fn new(mesh: &IntrinsicMesh) -> Result<Laplacian> {
        let mut triangles = try_vec(mesh.triangles.len(), "the Laplacian")?;
        triangles.extend(mesh.triangles.iter().zip(&mesh.lengths).map(|(&v, &l)| Triangle::new(v, l)));
        let mut mass = try_filled(mesh.vertex_count, 0.0, "the mass matrix")?;
        for t in &triangles {
            t.vertices.iter().for_each(|&v| mass[v as usize] += t.area / 3.0);
        }
        let (columns, rows) = lower_pattern(mesh.vertex_count, &triangles)?;
        let mut stiffness = try_filled(rows.len(), 0.0, "the Laplacian")?;
        for t in &triangles {
            for k in 0..3 {
                let (i, j, w) = (t.vertices[(k + 1) % 3], t.vertices[(k + 2) % 3], t.weight[k]);
                if i == j {
                    continue; // a self-edge of an intrinsic triangulation adds nothing
                }
                stiffness[columns[i as usize] as usize] += w;
                stiffness[columns[j as usize] as usize] += w;
                let (row, column) = (i.max(j), i.min(j));
                let range = columns[column as usize] as usize..columns[column as usize + 1] as usize;
                if let Ok(at) = rows[range.clone()].binary_search(&row) {
                    stiffness[range.start + at] -= w;
                }
            }
        }
        Ok(Laplacian { triangles, mass, columns: columns.into(), rows: rows.into(), stiffness })
    }

    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.mass.len()
    }

    /// M + t L with the time step `t` of every vertex's component (Eq. 6). Vertices without area get a unit diagonal.
    pub fn heat_operator(&self, t: &[f64]) -> SymmetricMatrix {
        let mut values = self.stiffness.clone();
        for j in 0..self.vertex_count() {
            let (first, end) = (self.columns[j] as usize, self.columns[j + 1] as usize);
            values[first..end].iter_mut().for_each(|v| *v *= t[j]);
            values[first] += if self.mass[j] > 0.0 { self.mass[j] } else { 1.0 };
        }
        self.matrix(values)
    }

    /// L with the rows and columns of `grounded` vertices replaced by those of the identity, scaled to their diagonal
    /// (Eq. 9 made regular: one vertex a component, where the solution is then zero).
    pub fn grounded(&self, grounded: &[bool]) -> SymmetricMatrix {
        let mut values = self.stiffness.clone();
        for j in 0..self.vertex_count() {
            let (first, end) = (self.columns[j] as usize, self.columns[j + 1] as usize);
            for k in first + 1..end {
                if grounded[j] || grounded[self.rows[k] as usize] {
                    values[k] = 0.0;
                }
            }
            if values[first] <= 0.0 {
                values[first] = 1.0;
            }
        }
        self.matrix(values)
    }

    fn matrix(&self, values: Vec<f64>) -> SymmetricMatrix {
        SymmetricMatrix { columns: self.columns.clone(), rows: self.rows.clone(), values }
    }
}

/// Pattern of the lower triangle: the diagonal and one entry an edge, rows ascending.
fn lower_pattern(n: usize, triangles: &[Triangle]) -> Result<(Vec<u32>, Vec<u32>)> {
    // --- every edge as often as triangles name it, bucketed by its lower vertex
    let edges = || triangles.iter().flat_map(|t| (0..3).map(|k| (t.vertices[k], t.vertices[(k + 1) % 3])));
    let mut start: Vec<u32> = try_filled(n + 1, 0, "the Laplacian")?;
    edges().for_each(|(a, b)| start[a.min(b) as usize + 1] += 1);
    for v in 0..n {
        start[v + 1] += start[v];
    }
    let mut upper: Vec<u32> = try_filled(3 * triangles.len(), 0, "the Laplacian")?;
    let mut fill = start.clone();
    for (a, b) in edges() {
        let slot = &mut fill[a.min(b) as usize];
        upper[*slot as usize] = a.max(b);
        *slot += 1;
    }
    // --- columns without repetitions
    let mut columns: Vec<u32> = try_vec(n + 1, "the Laplacian")?;
    let mut rows: Vec<u32> = try_vec(n + 3 * triangles.len() / 2 + 1, "the Laplacian")?;
    for v in 0..n as u32 {
        columns.push(rows.len() as u32);
        rows.push(v);
        let bucket = &mut upper[start[v as usize] as usize..start[v as usize + 1] as usize];
        bucket.sort_unstable();
        let mut last = v;
        for &row in bucket.iter() {
            if row != last {
                rows.push(row);
                last = row;
            }
        }
    }
    columns.push(rows.len() as u32);
    Ok((columns, rows))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes::icosphere;

    fn sphere() -> (Vec<[f64; 3]>, Laplacian) {
        let (p, t) = icosphere(4);
        let l = Laplacian::new(&IntrinsicMesh::from_extrinsic(&p, &t).unwrap()).unwrap();
        (p, l)
    }

    #[test]
    fn coordinates_are_eigenfunctions_of_the_sphere() {
        // L x = 2 M x on the unit sphere
        let (p, l) = sphere();
        let x: Vec<f64> = p.iter().map(|q| q[0]).collect();
        let mut y = vec![0.0; x.len()];
        // t so large that the mass is lost: the operator is the stiffness
        l.heat_operator(&vec![1e12; x.len()]).multiply(&x, &mut y);
        let (mut num, mut den) = (0.0, 0.0);
        for i in 0..x.len() {
            num += (y[i] / 1e12 - 2.0 * l.mass[i] * x[i]).powi(2);
            den += (2.0 * l.mass[i] * x[i]).powi(2);
        }
        assert!((num / den).sqrt() < 0.02, "{}", (num / den).sqrt());
        let area: f64 = l.mass.iter().sum();
        assert!((area / (4.0 * std::f64::consts::PI) - 1.0).abs() < 5e-3);
    }

    #[test]
    fn stiffness_of_a_triangle_is_the_energy_of_its_gradient() {
        // u = x on the right triangle (0,0) (2,0) (0,1): |grad|^2 area = 1
        let t = Triangle::new([0, 1, 2], [2.0, 5f64.sqrt(), 1.0]);
        let u = [0.0, 2.0, 0.0];
        let s = t.stiffness(u);
        let energy: f64 = (0..3).map(|k| u[k] * s[k]).sum();
        assert!((energy - 1.0).abs() < 1e-14 && (t.area - 1.0).abs() < 1e-15);
        assert!(s.iter().sum::<f64>().abs() < 1e-15);
    }

    #[test]
    fn heron_survives_needles() {
        let a = heron([1.0, 1.0, 1e-9]);
        assert!((a / 0.5e-9 - 1.0).abs() < 1e-6);
        assert_eq!(heron([2.0, 1.0, 1.0]), 0.0);
    }
}

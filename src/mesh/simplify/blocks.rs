//! The first stage for very large meshes: most triangles are gone before the mesh is looked at as a whole.
//!
//! Vertices are gathered in blocks of neighbours, each of which is simplified on its own, in memory that stays near the
//! processor, many at a time. The vertices that have a triangle across the border of a block stay for the second stage.
//! Blocks depend on the mesh alone, so the result does not depend on the number of threads.

use super::{Kind, Simplified, SimplifyOptions, Work};
use crate::error::{Result, try_filled, try_vec};
use crate::job::Job;
use crate::mesh::NONE;
use crate::mesh::measure::Vec3;
use rayon::prelude::*;

/// Vertices of a block.
const BLOCK: usize = 1 << 14;
/// Meshes of more triangles than this have a first stage, ...
pub(super) const MANY: usize = 300_000;
/// ... which leaves this share of each block, or so many times as many triangles as are aimed at.
const LEFT: f64 = 0.1;
const SPARE: f64 = 4.0;
/// Part of the error that is left to the first stage, as a share of all.
const ERROR: f64 = 0.2;

/// The mesh after the first stage, and what the second may do to it; none if there is no need of two.
///
/// # Errors
/// [`crate::error::Error::NoMemory`], [`crate::error::Error::Cancelled`].
pub(super) fn first_stage(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    (lo, size): (Vec3, f64),
    options: &SimplifyOptions,
    job: &Job,
) -> Result<Option<(Simplified, SimplifyOptions)>> {
    let left = LEFT.max(SPARE * options.target_faces as f64 / triangles.len() as f64);
    if triangles.len() <= MANY || left > 0.5 {
        return Ok(None);
    }
    let blocks = Blocks::new(positions, triangles, (lo, size))?;
    let max_error = ERROR * options.max_error;
    let one = |b: usize| {
        job.check()?;
        let (own, faces) = blocks.get(b);
        let points = own.iter().map(|o| positions[o.1 as usize]).collect::<Vec<_>>();
        let local = |v: u32| blocks.rank[v as usize] - (b * BLOCK) as u32;
        let faces: Vec<[u32; 3]> = faces.iter().map(|&f| triangles[f as usize].map(local)).collect();
        let mut work = Work::new(&points, &faces, lo, size)?;
        for (kind, _) in work.kind.iter_mut().zip(own).filter(|(_, o)| blocks.shared[o.1 as usize]) {
            *kind = Kind::Shared;
        }
        let target_faces = (left * faces.len() as f64) as usize;
        work.run(&SimplifyOptions { target_faces, max_error }, size, job)?;
        Ok(work.finish())
    };
    let done: Vec<Simplified> = (0..blocks.count()).into_par_iter().with_max_len(1).map(one).collect::<Result<_>>()?;
    let rest = SimplifyOptions { max_error: options.max_error - max_error, ..*options };
    Ok(Some((blocks.joined(triangles, &done)?, rest)))
}

/// A mesh in blocks.
struct Blocks {
    /// The vertices that triangles use, by where they are: a block is a run of [`BLOCK`] of them.
    order: Vec<(u64, u32)>,
    /// By vertex its place in that order; [`NONE`] without a triangle.
    rank: Vec<u32>,
    /// Vertices of a triangle that is in no block.
    shared: Vec<bool>,
    /// The triangles by block, last those in none: where each list starts, and the lists.
    first: Vec<u32>,
    faces: Vec<u32>,
}

impl Blocks {
    fn new(positions: &[Vec3], triangles: &[[u32; 3]], (lo, size): (Vec3, f64)) -> Result<Blocks> {
        let mut rank = try_filled(positions.len(), NONE, "simplified mesh")?;
        triangles.iter().flatten().for_each(|&v| rank[v as usize] = 0);
        let mut order: Vec<(u64, u32)> = try_vec(rank.iter().filter(|r| **r != NONE).count(), "simplified mesh")?;
        let used = (0..positions.len() as u32).filter(|&v| rank[v as usize] != NONE);
        order.extend(used.map(|v| (along_curve(positions[v as usize], lo, size), v)));
        order.par_sort_unstable();
        order.iter().zip(0..).for_each(|(o, k)| rank[o.1 as usize] = k);
        let count = order.len().div_ceil(BLOCK);
        let block = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| rank[v as usize] as usize / BLOCK);
            if a == b && b == c { a } else { count }
        };
        let mut shared = try_filled(positions.len(), false, "simplified mesh")?;
        let mut first = try_filled(count + 2, 0u32, "simplified mesh")?;
        for t in triangles {
            let b = block(t);
            first[b + 1] += 1;
            if b == count {
                t.iter().for_each(|&v| shared[v as usize] = true);
            }
        }
        for b in 0..=count {
            first[b + 1] += first[b];
        }
        let mut fill = first.clone();
        let mut faces = try_filled(triangles.len(), 0u32, "simplified mesh")?;
        for (f, t) in triangles.iter().enumerate() {
            let slot = &mut fill[block(t)];
            faces[*slot as usize] = f as u32;
            *slot += 1;
        }
        Ok(Blocks { order, rank, shared, first, faces })
    }

    fn count(&self) -> usize {
        self.first.len() - 2
    }

    /// Vertices and triangles of a block.
    fn get(&self, b: usize) -> (&[(u64, u32)], &[u32]) {
        let vertices = &self.order[b * BLOCK..self.order.len().min((b + 1) * BLOCK)];
        (vertices, &self.faces[self.first[b] as usize..self.first[b + 1] as usize])
    }

    /// One mesh from the blocks and the triangles between them.
    fn joined(&self, triangles: &[[u32; 3]], done: &[Simplified]) -> Result<Simplified> {
        let between = &self.faces[self.first[done.len()] as usize..];
        let total = between.len() + done.iter().map(|d| d.triangles.len()).sum::<usize>();
        let mut out = Simplified { triangles: try_vec(total, "simplified mesh")?, onto: Vec::new() };
        out.onto = try_vec(self.rank.len(), "simplified mesh")?;
        out.onto.extend(0..self.rank.len() as u32);
        out.triangles.extend(between.iter().map(|&f| triangles[f as usize]));
        for (b, block) in done.iter().enumerate() {
            let vertices = self.get(b).0;
            out.triangles.extend(block.triangles.iter().map(|t| t.map(|v| vertices[v as usize].1)));
            for (v, &to) in vertices.iter().zip(&block.onto) {
                out.onto[v.1 as usize] = vertices[to as usize].1;
            }
        }
        Ok(out)
    }
}

/// How far along a curve through all places a point lies that passes near places one after the other (Morton 1966).
fn along_curve(p: Vec3, lo: Vec3, size: f64) -> u64 {
    let spread = |x: f64| {
        let mut v = (x.clamp(0.0, 1.0) * ((1 << 21) - 1) as f64) as u64;
        for (shift, mask) in [
            (32, 0x001F_0000_0000_FFFF),
            (16, 0x001F_0000_FF00_00FF),
            (8, 0x100F_00F0_0F00_F00F),
            (4, 0x10C3_0C30_C30C_30C3),
            (2, 0x1249_2492_4924_9249),
        ] {
            v = (v | v << shift) & mask;
        }
        v
    };
    (0..3).fold(0, |key, k| key | spread((p[k] - lo[k]) / size) << k)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::CancelToken;
    use crate::mesh::measure::{area, corners, distance};
    use crate::mesh::shapes::{Shape, icosphere};
    use crate::mesh::simplify::simplify;

    fn simple((p, t): &Shape, target_faces: usize, max_error: f64, threads: usize) -> Simplified {
        assert!(t.len() > MANY);
        let job = Job::new(threads, None, CancelToken::default());
        job.run(None, || simplify(p, t, &SimplifyOptions { target_faces, max_error }, &job)).unwrap()
    }

    #[test]
    fn a_sphere_of_very_many_triangles_stays_one_on_any_number_of_threads() {
        let sphere = icosphere(7);
        let found = simple(&sphere, 2_000, 0.01, 3);
        let mut left: Vec<u32> = found.triangles.iter().flatten().copied().collect();
        left.sort_unstable();
        left.dedup();
        assert!(found.triangles.len() <= 2_000 && found.triangles.len() > 1_900, "{}", found.triangles.len());
        assert_eq!(found.triangles.len(), 2 * left.len() - 4, "still a sphere");
        for (v, &to) in found.onto.iter().enumerate() {
            assert!(left.binary_search(&to).is_ok() && found.onto[to as usize] == to);
            // triangles of about 0.12 a side
            assert!(distance(sphere.0[v], sphere.0[to as usize]) < 0.4);
        }
        let whole: f64 = found.triangles.iter().map(|t| area(corners(&sphere.0, *t))).sum();
        assert!((whole / (4.0 * std::f64::consts::PI) - 1.0).abs() < 0.01, "{whole}");
        assert_eq!(found, simple(&sphere, 2_000, 0.01, 1));
    }

    #[test]
    fn a_flat_sheet_of_very_many_triangles_becomes_a_few() {
        let n = 400;
        let at = |i: u32, j: u32| i * (n + 1) + j;
        let points = (0..=n).flat_map(|i| (0..=n).map(move |j| [f64::from(i), 0.5 * f64::from(j), 0.0])).collect();
        let cells = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
        let triangles = cells.flat_map(|(i, j)| {
            [[at(i, j), at(i + 1, j), at(i, j + 1)], [at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)]]
        });
        let sheet = (points, triangles.collect());
        let found = simple(&sheet, 0, 1e-9, 2);
        assert!(found.triangles.len() < 10, "{}", found.triangles.len());
        let whole: f64 = found.triangles.iter().map(|t| area(corners(&sheet.0, *t))).sum();
        assert!((whole / 80_000.0 - 1.0).abs() < 1e-9, "nothing lost, nothing folded: {whole}");
    }
}

//! The two inner loops of ray shooting, eight boxes and four triangles at a time: once in plain Rust (any processor) and
//! once for x86-64-v3 (AVX2), picked at run time by [`with_best`]. Both give the same hits: box tests are conservative,
//! so their rounding does not matter, and the triangle test uses the same operations in the same order, without fused
//! multiply-add.

use super::shaft::{ABOUT, ROUNDING, Single};
use super::tree::{Block, Node};

/// A ray prepared for the boxes, in single precision.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ray {
    /// Origin and direction.
    pub o: [f64; 3],
    pub d: [f64; 3],
    /// Origin, rounded, and reciprocal direction, kept finite.
    pub o32: [f32; 3],
    pub inv: [f32; 3],
    /// Index into [`Node::bounds`] of the plane that the ray meets first, on each axis; the other is 3 away.
    pub near: [usize; 3],
}

/// Directions smaller than this move a ray less than the padding of the boxes over its whole length.
const SMALLEST: f32 = 1e-18;

impl Ray {
    /// The ray from `o` along the unit vector `d`.
    #[inline(always)]
    pub fn new(o: [f64; 3], d: [f64; 3]) -> Ray {
        let inv = d.map(|x| {
            let x = x as f32;
            1.0 / if x.abs() < SMALLEST { SMALLEST.copysign(x) } else { x }
        });
        let near = [0, 1, 2].map(|a| a + 3 * (inv[a] < 0.0) as usize);
        Ray { o, d, o32: o.map(|x| x as f32), inv, near }
    }
}

/// A ray prepared for the triangles, in double precision.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shear {
    /// Axes after the permutation that makes the last one the longest of the direction and keeps the winding.
    pub k: [usize; 3],
    /// Origin along these axes.
    pub o: [f64; 3],
    /// Shear x and y, and scale z.
    pub s: [f64; 3],
}

impl Shear {
    #[inline(always)]
    pub fn new(ray: &Ray) -> Shear {
        let [x, y, z] = ray.d.map(f64::abs);
        // Without branches: the longest axis is as good as random.
        let kz = if (x > y) & (x > z) { 0 } else { 2 - (y > z) as usize };
        let turned = (ray.d[kz] < 0.0) as usize;
        let (kx, ky) = ((kz + 1 + turned) % 3, (kz + 2 - turned) % 3);
        let sz = 1.0 / ray.d[kz];
        Shear { k: [kx, ky, kz], o: [kx, ky, kz].map(|k| ray.o[k]), s: [ray.d[kx] * sz, ray.d[ky] * sz, sz] }
    }
}

/// What a ray meets in one block.
pub(super) struct BlockHits {
    /// Ray parameter of each lane.
    pub t: [f64; 4],
    /// Lanes that are hit with `tmin < t <= tmax`.
    pub hit: u32,
    /// Lanes whose outward side faces away from the ray's origin: the ray leaves the solid there.
    pub exit: u32,
}

/// The inner loops, for one instruction set.
pub(super) trait Lanes: Copy + Send + Sync {
    /// A ray as the box test wants it.
    type Slopes: Copy;
    /// Prepares a ray for many box tests.
    fn slopes(self, ray: &Ray) -> Self::Slopes;
    /// Children of `node` whose boxes the ray enters before `tmax`, as a bit mask, and where it enters each.
    fn boxes(self, node: &Node, slopes: &Self::Slopes, tmax: f32, enter: &mut [f32; 8]) -> u32;
    /// Watertight ray-triangle tests (Woop, Benthin, Wald 2013) in double precision.
    fn triangles(self, block: &Block, ray: &Shear, tmin: f64, tmax: f64) -> BlockHits;
    /// Children of `node` whose boxes `shaft` may meet, as a bit mask, and those that lie about its apex.
    fn shaft(self, node: &Node, shaft: &Single) -> (u32, u32);
    /// Squared distance of `p` to each child's box, and the children nearer than the squared distance `limit`.
    fn distances(self, node: &Node, p: [f32; 3], limit: f32, d2: &mut [f32; 8]) -> u32;
}

/// The far side of a box is pushed out by this factor, more than the rounding of the slab test (Ize 2013).
const FAR: f32 = 1.0 + 8.0 * f32::EPSILON;

/// Any processor.
#[derive(Debug, Clone, Copy)]
pub(super) struct Portable;

#[inline(always)]
fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

impl Lanes for Portable {
    type Slopes = Ray;

    #[inline(always)]
    fn slopes(self, ray: &Ray) -> Ray {
        *ray
    }

    #[inline(always)]
    fn boxes(self, node: &Node, ray: &Ray, tmax: f32, enter: &mut [f32; 8]) -> u32 {
        let mut exit = [tmax; 8];
        *enter = [0.0; 8];
        for a in 0..3 {
            let near = &node.bounds[ray.near[a]];
            let far = &node.bounds[(ray.near[a] + 3) % 6];
            for k in 0..8 {
                enter[k] = max((near[k] - ray.o32[a]) * ray.inv[a], enter[k]);
                exit[k] = min((far[k] - ray.o32[a]) * ray.inv[a] * FAR, exit[k]);
            }
        }
        (0..8).fold(0, |mask, k| mask | (((enter[k] <= exit[k]) as u32) << k))
    }

    #[inline(always)]
    fn triangles(self, block: &Block, ray: &Shear, tmin: f64, tmax: f64) -> BlockHits {
        let mut out = BlockHits { t: [0.0; 4], hit: 0, exit: 0 };
        let [kx, ky, kz] = ray.k;
        for k in 0..4 {
            let [a, b, c] = [0, 1, 2].map(|v| {
                let z = block.v[v][kz][k] - ray.o[2];
                let x = (block.v[v][kx][k] - ray.o[0]) - ray.s[0] * z;
                let y = (block.v[v][ky][k] - ray.o[1]) - ray.s[1] * z;
                [x, y, z]
            });
            let u = c[0] * b[1] - c[1] * b[0];
            let v = a[0] * c[1] - a[1] * c[0];
            let w = b[0] * a[1] - b[1] * a[0];
            let inside = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
            let det = (u + v) + w;
            let t = ((u * a[2] + v * b[2]) + w * c[2]) * ray.s[2] / det;
            out.t[k] = t;
            out.hit |= ((inside && t > tmin && t <= tmax) as u32) << k;
            out.exit |= ((det < 0.0) as u32) << k;
        }
        out
    }

    #[inline(always)]
    fn shaft(self, node: &Node, shaft: &Single) -> (u32, u32) {
        let (mut met, mut about) = (0, 0);
        for k in 0..8 {
            let lo = [0, 1, 2].map(|a| node.bounds[a][k]);
            let hi = [3, 4, 5].map(|a| node.bounds[a][k]);
            let half = [0, 1, 2].map(|a| 0.5 * (hi[a] - lo[a]));
            let middle = [0, 1, 2].map(|a| 0.5 * (lo[a] + hi[a]));
            let way = [0, 1, 2].map(|a| middle[a] - shaft.apex[a]);
            let gap = [0, 1, 2].map(|a| max((middle[a] - shaft.centre[a]).abs() - half[a], 0.0));
            let dot = |p: [f32; 3], q: [f32; 3]| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
            let height = dot(way, shaft.axis);
            let lateral = [0, 1, 2].map(|a| way[a] - height * shaft.axis[a]);
            let beside = dot(lateral, lateral).sqrt();
            // The plane that touches the cone along a line on the side of the box's middle: how far inside of it the
            // box reaches, times the distance of the middle from the axis.
            let normal = [0, 1, 2].map(|a| (shaft.sin * beside) * shaft.axis[a] - shaft.cos * lateral[a]);
            let reach = dot(normal.map(|x| x.abs() + ROUNDING), half);
            let inside = beside * (height * shaft.sin - beside * shaft.cos + ROUNDING) + reach;
            let is_met = (lo[0] <= hi[0]) & (inside >= 0.0) & (dot(gap, gap) <= shaft.radius2);
            met |= (is_met as u32) << k;
            about |= ((dot(way, way) <= ABOUT * dot(half, half)) as u32) << k;
        }
        (met, about)
    }

    #[inline(always)]
    fn distances(self, node: &Node, p: [f32; 3], limit: f32, d2: &mut [f32; 8]) -> u32 {
        *d2 = [0.0; 8];
        for a in 0..3 {
            for k in 0..8 {
                let d = max(max(node.bounds[a][k] - p[a], p[a] - node.bounds[a + 3][k]), 0.0);
                d2[k] += d * d;
            }
        }
        (0..8).fold(0, |mask, k| mask | (((d2[k] < limit) as u32) << k))
    }
}

#[cfg(target_arch = "x86_64")]
mod v3 {
    use super::*;
    use core::arch::x86_64::{__m256, __m256d, _CMP_GE_OQ, _CMP_GT_OQ, _CMP_LE_OQ, _CMP_LT_OQ};
    use pulp::x86::V3;

    #[inline(always)]
    fn ps(v: &[f32; 8]) -> __m256 {
        pulp::cast(*v)
    }

    #[inline(always)]
    fn pd(v: &[f64; 4]) -> __m256d {
        pulp::cast(*v)
    }

    /// Reciprocal direction and origin over direction, in all lanes, and the planes that the ray meets first and last.
    #[derive(Clone, Copy)]
    pub(in crate::thickness) struct Slopes {
        inv: [__m256; 3],
        shift: [__m256; 3],
        near: [usize; 3],
        far: [usize; 3],
    }

    impl Lanes for V3 {
        type Slopes = Slopes;

        #[inline(always)]
        fn slopes(self, ray: &Ray) -> Slopes {
            let axis = |a: usize| {
                let (inv, shift) = (ray.inv[a], ray.o32[a] * ray.inv[a]);
                (pulp::cast([inv; 8]), pulp::cast([shift; 8]))
            };
            let [x, y, z] = [axis(0), axis(1), axis(2)];
            Slopes { inv: [x.0, y.0, z.0], shift: [x.1, y.1, z.1], near: ray.near, far: ray.near.map(|a| (a + 3) % 6) }
        }

        #[inline(always)]
        fn boxes(self, node: &Node, slopes: &Slopes, tmax: f32, enter: &mut [f32; 8]) -> u32 {
            let i = self.avx;
            macro_rules! plane {
                ($bound:expr, $a:expr) => {
                    self.fma._mm256_fmsub_ps(ps(&node.bounds[$bound[$a] % 6]), slopes.inv[$a], slopes.shift[$a])
                };
            }
            let (near, far) = (&slopes.near, &slopes.far);
            let (x, y, z) = (plane!(near, 0), plane!(near, 1), plane!(near, 2));
            let first = i._mm256_max_ps(i._mm256_max_ps(x, y), i._mm256_max_ps(z, i._mm256_setzero_ps()));
            let (x, y, z) = (plane!(far, 0), plane!(far, 1), plane!(far, 2));
            let last = i._mm256_mul_ps(i._mm256_min_ps(i._mm256_min_ps(x, y), z), i._mm256_set1_ps(FAR));
            let last = i._mm256_min_ps(last, i._mm256_set1_ps(tmax));
            *enter = pulp::cast(first);
            i._mm256_movemask_ps(i._mm256_cmp_ps::<_CMP_LE_OQ>(first, last)) as u32
        }

        #[inline(always)]
        fn triangles(self, block: &Block, ray: &Shear, tmin: f64, tmax: f64) -> BlockHits {
            // Macros rather than closures: a closure would not be compiled for this instruction set.
            let i = self.avx;
            macro_rules! sub {
                ($a:expr, $b:expr) => {
                    i._mm256_sub_pd($a, $b)
                };
            }
            macro_rules! mul {
                ($a:expr, $b:expr) => {
                    i._mm256_mul_pd($a, $b)
                };
            }
            macro_rules! add {
                ($a:expr, $b:expr) => {
                    i._mm256_add_pd($a, $b)
                };
            }
            macro_rules! and {
                ($a:expr, $b:expr) => {
                    i._mm256_and_pd($a, $b)
                };
            }
            let [kx, ky, kz] = ray.k;
            let (ox, oy, oz) = (i._mm256_set1_pd(ray.o[0]), i._mm256_set1_pd(ray.o[1]), i._mm256_set1_pd(ray.o[2]));
            let (sx, sy, sz) = (i._mm256_set1_pd(ray.s[0]), i._mm256_set1_pd(ray.s[1]), i._mm256_set1_pd(ray.s[2]));
            let zero = i._mm256_setzero_pd();
            let mut corner = [[zero; 3]; 3];
            for (v, to) in corner.iter_mut().enumerate() {
                let z = sub!(pd(&block.v[v][kz]), oz);
                let x = sub!(sub!(pd(&block.v[v][kx]), ox), mul!(sx, z));
                let y = sub!(sub!(pd(&block.v[v][ky]), oy), mul!(sy, z));
                *to = [x, y, z];
            }
            let [a, b, c] = corner;
            let u = sub!(mul!(c[0], b[1]), mul!(c[1], b[0]));
            let v = sub!(mul!(a[0], c[1]), mul!(a[1], c[0]));
            let w = sub!(mul!(b[0], a[1]), mul!(b[1], a[0]));
            macro_rules! ge {
                ($a:expr) => {
                    i._mm256_cmp_pd::<_CMP_GE_OQ>($a, zero)
                };
            }
            macro_rules! le {
                ($a:expr) => {
                    i._mm256_cmp_pd::<_CMP_LE_OQ>($a, zero)
                };
            }
            let inside = i._mm256_or_pd(and!(and!(ge!(u), ge!(v)), ge!(w)), and!(and!(le!(u), le!(v)), le!(w)));
            if i._mm256_movemask_pd(inside) == 0 {
                return BlockHits { t: [0.0; 4], hit: 0, exit: 0 };
            }
            let det = add!(add!(u, v), w);
            let t = add!(add!(mul!(u, a[2]), mul!(v, b[2])), mul!(w, c[2]));
            let t = i._mm256_div_pd(mul!(t, sz), det);
            let in_range = and!(
                i._mm256_cmp_pd::<_CMP_GT_OQ>(t, i._mm256_set1_pd(tmin)),
                i._mm256_cmp_pd::<_CMP_LE_OQ>(t, i._mm256_set1_pd(tmax))
            );
            BlockHits {
                t: pulp::cast(t),
                hit: i._mm256_movemask_pd(and!(inside, in_range)) as u32,
                exit: i._mm256_movemask_pd(i._mm256_cmp_pd::<_CMP_LT_OQ>(det, zero)) as u32,
            }
        }

        #[inline(always)]
        fn shaft(self, node: &Node, shaft: &Single) -> (u32, u32) {
            let (i, m) = (self.avx, self.fma);
            macro_rules! dot {
                ($p:expr, $q:expr) => {
                    m._mm256_fmadd_ps($p[2], $q[2], m._mm256_fmadd_ps($p[1], $q[1], i._mm256_mul_ps($p[0], $q[0])))
                };
            }
            let zero = i._mm256_setzero_ps();
            let one_half = i._mm256_set1_ps(0.5);
            let sign = i._mm256_set1_ps(-0.0);
            let (mut half, mut way, mut gap, mut axis) = ([zero; 3], [zero; 3], [zero; 3], [zero; 3]);
            for a in 0..3 {
                let (lo, hi) = (ps(&node.bounds[a]), ps(&node.bounds[a + 3]));
                let middle = i._mm256_mul_ps(i._mm256_add_ps(lo, hi), one_half);
                half[a] = i._mm256_mul_ps(i._mm256_sub_ps(hi, lo), one_half);
                way[a] = i._mm256_sub_ps(middle, i._mm256_set1_ps(shaft.apex[a]));
                let off = i._mm256_andnot_ps(sign, i._mm256_sub_ps(middle, i._mm256_set1_ps(shaft.centre[a])));
                gap[a] = i._mm256_max_ps(i._mm256_sub_ps(off, half[a]), zero);
                axis[a] = i._mm256_set1_ps(shaft.axis[a]);
            }
            let (sin, cos) = (i._mm256_set1_ps(shaft.sin), i._mm256_set1_ps(shaft.cos));
            let height = dot!(way, axis);
            let mut lateral = [zero; 3];
            for a in 0..3 {
                lateral[a] = m._mm256_fnmadd_ps(height, axis[a], way[a]);
            }
            let beside = i._mm256_sqrt_ps(dot!(lateral, lateral));
            let (up, rounding) = (i._mm256_mul_ps(sin, beside), i._mm256_set1_ps(ROUNDING));
            let mut reach = [zero; 3];
            for a in 0..3 {
                let normal = m._mm256_fmsub_ps(up, axis[a], i._mm256_mul_ps(cos, lateral[a]));
                reach[a] = i._mm256_add_ps(i._mm256_andnot_ps(sign, normal), rounding);
            }
            let inside = i._mm256_add_ps(m._mm256_fmsub_ps(height, sin, i._mm256_mul_ps(beside, cos)), rounding);
            let inside = m._mm256_fmadd_ps(beside, inside, dot!(reach, half));
            let met = i._mm256_and_ps(
                i._mm256_cmp_ps::<_CMP_GE_OQ>(inside, zero),
                i._mm256_cmp_ps::<_CMP_LE_OQ>(dot!(gap, gap), i._mm256_set1_ps(shaft.radius2)),
            );
            let met = i._mm256_and_ps(met, i._mm256_cmp_ps::<_CMP_GE_OQ>(half[0], zero));
            let size2 = i._mm256_mul_ps(dot!(half, half), i._mm256_set1_ps(ABOUT));
            let about = i._mm256_cmp_ps::<_CMP_LE_OQ>(dot!(way, way), size2);
            (i._mm256_movemask_ps(met) as u32, i._mm256_movemask_ps(about) as u32)
        }

        #[inline(always)]
        fn distances(self, node: &Node, p: [f32; 3], limit: f32, d2: &mut [f32; 8]) -> u32 {
            let i = self.avx;
            let mut sum = i._mm256_setzero_ps();
            for a in 0..3 {
                let x = i._mm256_set1_ps(p[a]);
                let below = i._mm256_sub_ps(ps(&node.bounds[a]), x);
                let above = i._mm256_sub_ps(x, ps(&node.bounds[a + 3]));
                let d = i._mm256_max_ps(i._mm256_max_ps(below, above), i._mm256_setzero_ps());
                sum = i._mm256_add_ps(sum, i._mm256_mul_ps(d, d));
            }
            *d2 = pulp::cast(sum);
            i._mm256_movemask_ps(i._mm256_cmp_ps::<_CMP_LT_OQ>(sum, i._mm256_set1_ps(limit))) as u32
        }
    }
}

/// Work that is compiled once per instruction set. Everything below `run` must be `#[inline(always)]` to profit.
pub(super) trait Work {
    type Output;
    fn run<L: Lanes>(self, lanes: L) -> Self::Output;
}

/// Runs `work` with the best instruction set that this processor has.
pub(super) fn with_best<W: Work>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    if let Some(v3) = pulp::x86::V3::try_new() {
        struct Call<W>(W, pulp::x86::V3);
        impl<W: Work> pulp::NullaryFnOnce for Call<W> {
            type Output = W::Output;
            #[inline(always)]
            fn call(self) -> W::Output {
                self.0.run(self.1)
            }
        }
        return v3.vectorize(Call(work, v3));
    }
    work.run(Portable)
}

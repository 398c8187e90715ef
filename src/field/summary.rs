//! A field in a few numbers (the maxima and means of Figs. 12 and 13) and its histograms (Fig. 12).

use super::Field;
use crate::error::{Error, Result, try_filled, try_vec};
use crate::mesh::NONE;

/// Which value of a [`Field`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Farthest geodesic distance.
    D1,
    /// Width.
    D2,
    /// Slenderness D1/D2.
    Ratio,
}

/// Maxima, means and where they are. Lengths in model units; NaN and [`NONE`] when no vertex has a value. Means are over
/// vertices, as in the paper.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Summary {
    /// Largest D1: the longest way across the part ([`super::Reach`]), in the print profile also between points that are
    /// no vertices.
    pub d1_max: f64,
    /// Mean D1.
    pub d1_mean: f64,
    /// Largest D2.
    pub d2_max: f64,
    /// Mean D2.
    pub d2_mean: f64,
    /// Smallest D2.
    pub d2_min: f64,
    /// D1max / D2max, the part's slenderness.
    pub ratio_max: f64,
    /// D1ave / D2ave.
    pub ratio_mean: f64,
    /// Largest D1/D2 of a vertex.
    pub vertex_ratio_max: f64,
    /// The two ends of `d1_max`.
    pub d1_max_ends: [[f64; 3]; 2],
    /// Vertex of `d2_max`.
    pub d2_max_at: u32,
    /// Vertex of `d2_min`.
    pub d2_min_at: u32,
    /// Vertex of `vertex_ratio_max`.
    pub vertex_ratio_max_at: u32,
    /// Vertices without a ratio.
    pub undefined_vertices: u64,
}

/// Shares of vertices by value.
#[derive(Debug, Clone, PartialEq)]
pub struct Histogram {
    /// Limits of the bins, ascending, one more than there are bins; the values' own range.
    pub edges: Vec<f64>,
    /// Share of the vertices with a value in each bin; the upper limit belongs to the last. The shares add up to 1.
    pub share: Vec<f64>,
}

/// Largest value, its vertex, and the mean of the values that are numbers.
fn largest_and_mean(values: &[f64]) -> (f64, u32, f64) {
    let (mut max, mut at, mut sum, mut count) = (f64::NAN, NONE, 0.0, 0u64);
    for (v, &x) in values.iter().enumerate().filter(|(_, x)| x.is_finite()) {
        if at == NONE || x > max {
            (max, at) = (x, v as u32);
        }
        sum += x;
        count += 1;
    }
    (max, at, if count > 0 { sum / count as f64 } else { f64::NAN })
}

impl Field {
    /// The values of one quantity by welded vertex.
    pub fn values(&self, quantity: Quantity) -> &[f64] {
        match quantity {
            Quantity::D1 => &self.d1,
            Quantity::D2 => &self.d2,
            Quantity::Ratio => &self.ratio,
        }
    }

    /// Maxima, means and where they are.
    pub fn summary(&self) -> Summary {
        let (_, _, d1_mean) = largest_and_mean(&self.d1);
        let d1_max = if self.reach.length > 0.0 { self.reach.length } else { f64::NAN };
        let (d2_max, d2_max_at, d2_mean) = largest_and_mean(&self.d2);
        let (vertex_ratio_max, vertex_ratio_max_at, _) = largest_and_mean(&self.ratio);
        let negative: Vec<f64> = self.d2.iter().map(|d| -d).collect();
        let (d2_min, d2_min_at, _) = largest_and_mean(&negative);
        Summary {
            d1_max,
            d1_mean,
            d2_max,
            d2_mean,
            d2_min: -d2_min,
            ratio_max: d1_max / d2_max,
            ratio_mean: d1_mean / d2_mean,
            vertex_ratio_max,
            d1_max_ends: self.reach.ends,
            d2_max_at,
            d2_min_at,
            vertex_ratio_max_at,
            undefined_vertices: self.ratio.iter().filter(|r| !r.is_finite()).count() as u64,
        }
    }

    /// Probability distribution of a quantity over the vertices that have it, in `bins` bins of equal width.
    pub fn histogram(&self, quantity: Quantity, bins: usize) -> Result<Histogram> {
        if !(1..=1_000_000).contains(&bins) {
            return Err(Error::Argument(format!("a histogram has 1 to 1000000 bins, not {bins}")));
        }
        let values = || self.values(quantity).iter().copied().filter(|x| x.is_finite());
        let (lo, hi) = values().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), x| (lo.min(x), hi.max(x)));
        if lo > hi {
            return Err(Error::Argument("no vertex has a value to count".into()));
        }
        let mut counts = try_filled(bins, 0u64, "the histogram")?;
        for x in values() {
            let bin = ((x - lo) / (hi - lo) * bins as f64) as usize; // NaN when all are equal: bin 0
            counts[bin.min(bins - 1)] += 1;
        }
        let total: u64 = counts.iter().sum();
        let mut edges = try_vec(bins + 1, "the histogram")?;
        edges.extend((0..=bins).map(|k| lo + (hi - lo) * k as f64 / bins as f64));
        Ok(Histogram { edges, share: counts.iter().map(|&c| c as f64 / total as f64).collect() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Reach;

    fn field(d1: &[f64], d2: &[f64]) -> Field {
        let ratio = d1.iter().zip(d2).map(|(a, b)| a / b).collect();
        let reach = Reach { length: d1.iter().fold(0.0, |m, x| x.max(m)), ends: [[1.0; 3], [2.0; 3]] };
        Field { d1: d1.into(), d2: d2.into(), ratio, reach, ..Field::default() }
    }

    #[test]
    fn summary_of_four_vertices() {
        let s = field(&[4.0, 2.0, 3.0, f64::NAN], &[1.0, f64::NAN, 2.0, f64::NAN]).summary();
        assert_eq!((s.d1_max, s.d1_mean, s.d1_max_ends), (4.0, 3.0, [[1.0; 3], [2.0; 3]]));
        assert_eq!((s.d2_max, s.d2_min, s.d2_mean, s.d2_max_at, s.d2_min_at), (2.0, 1.0, 1.5, 2, 0));
        assert_eq!((s.ratio_max, s.ratio_mean, s.vertex_ratio_max, s.undefined_vertices), (2.0, 2.0, 4.0, 2));
        let none = field(&[f64::NAN; 4], &[f64::NAN; 4]).summary();
        assert!(none.ratio_max.is_nan() && none.d1_max.is_nan() && none.d2_max_at == NONE);
    }

    #[test]
    fn shares_add_up_and_the_top_belongs_to_the_last_bin() {
        let f = field(&[0.0, 1.0, 2.0, 10.0], &[1.0; 4]);
        let h = f.histogram(Quantity::D1, 5).unwrap();
        assert_eq!(h.edges, [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]);
        assert_eq!(h.share, [0.5, 0.25, 0.0, 0.0, 0.25]);
        let flat = f.histogram(Quantity::D2, 3).unwrap();
        assert_eq!(flat.share, [1.0, 0.0, 0.0]);
        assert!(f.histogram(Quantity::D1, 0).is_err());
        assert!(field(&[f64::NAN; 4], &[1.0; 4]).histogram(Quantity::D1, 2).is_err());
    }
}

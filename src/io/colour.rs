//! A perceptually uniform colour map for scalar fields.
//!
//! The map is viridis (Smith & van der Walt, CC0) in the degree-6 polynomial fit by Matt Zucker, published as CC0 at
//! shadertoy.com/view/WlfXRN. It is within 3.3/255 of the table, reads in grey print and for colour-blind eyes, and
//! keeps a few lines instead of 256 rows.

/// The colour for "no value": a mid grey, which viridis does not come near.
pub const NO_VALUE: [u8; 3] = [128, 128, 128];

/// Coefficients of t^0 .. t^6 for red, green and blue.
const VIRIDIS: [[f64; 3]; 7] = [
    [0.2777273272234177, 0.005407344544966578, 0.3340998053353061],
    [0.1050930431085774, 1.404613529898575, 1.384590162594685],
    [-0.3308618287255563, 0.214847559468213, 0.09509516302823659],
    [-4.634230498983486, -5.799100973351585, -19.33244095627987],
    [6.228269936347081, 14.17993336680509, 56.69055260068105],
    [4.776384997670288, -13.74514537774601, -65.35303263337234],
    [-5.435455855934631, 4.645852612178535, 26.3124352495832],
];

/// The colour of `value` on a scale from `lo` (dark violet) to `hi` (yellow); beyond them the end colours, and
/// [`NO_VALUE`] if `value` or a needed end of the scale is NaN.
pub fn colour_of(value: f64, lo: f64, hi: f64) -> [u8; 3] {
    let t = if value <= lo {
        0.0
    } else if value >= hi {
        1.0
    } else {
        // Halved, so that the range of the scale cannot overflow.
        (value * 0.5 - lo * 0.5) / (hi * 0.5 - lo * 0.5)
    };
    if t.is_nan() {
        return NO_VALUE;
    }
    let channel = |c: usize| VIRIDIS.iter().rev().fold(0.0, |sum, row| sum * t + row[c]);
    [0, 1, 2].map(|c| (channel(c) * 255.0).round().clamp(0.0, 255.0) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every 32nd row of the published table of viridis (matplotlib, `_viridis_data`, times 255), and the last.
    const TABLE: [(usize, [u8; 3]); 9] = [
        (0, [68, 1, 84]),
        (32, [71, 45, 123]),
        (64, [59, 82, 139]),
        (96, [44, 114, 142]),
        (128, [33, 145, 140]),
        (160, [40, 174, 128]),
        (192, [94, 201, 98]),
        (224, [173, 220, 48]),
        (255, [253, 231, 37]),
    ];

    #[test]
    fn follows_the_published_table() {
        for (row, wanted) in TABLE {
            let got = colour_of(row as f64, 0.0, 255.0);
            assert!((0..3).all(|c| got[c].abs_diff(wanted[c]) <= 4), "row {row}: {got:?}, table {wanted:?}");
        }
    }

    #[test]
    fn ends_and_odd_scales() {
        let [low, high] = [colour_of(0.0, 0.0, 1.0), colour_of(1.0, 0.0, 1.0)];
        assert_eq!(colour_of(-5.0, 0.0, 1.0), low);
        assert_eq!(colour_of(f64::NEG_INFINITY, 0.0, 1.0), low);
        assert_eq!(colour_of(f64::INFINITY, 0.0, 1.0), high);
        assert_eq!(colour_of(3.0, 3.0, 3.0), low);
        assert_eq!(colour_of(0.0, f64::MIN, f64::MAX), colour_of(0.5, 0.0, 1.0));
        for [v, lo, hi] in [[f64::NAN, 0.0, 1.0], [0.5, f64::NAN, 1.0], [0.5, 0.0, f64::NAN]] {
            assert_eq!(colour_of(v, lo, hi), NO_VALUE);
        }
    }

    #[test]
    fn lightness_rises_and_no_colour_is_near_the_grey() {
        let map: Vec<[u8; 3]> = (0..256).map(|i| colour_of(i as f64, 0.0, 255.0)).collect();
        let light = |c: &[u8; 3]| 0.2126 * c[0] as f64 + 0.7152 * c[1] as f64 + 0.0722 * c[2] as f64;
        assert!(map.windows(2).all(|w| light(&w[0]) <= light(&w[1]) + 0.8));
        assert!(map.iter().all(|c| (0..3).map(|k| c[k].abs_diff(NO_VALUE[k])).max() >= Some(50)));
    }
}

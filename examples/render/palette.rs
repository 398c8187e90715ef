//! Colours: a continuous scale for fields and a set of distinct colours for segments and features.

/// A colour in linear light, 0..1 a channel.
pub type Rgb = [f32; 3];

/// sRGB bytes to linear light.
pub fn linear(srgb: [u8; 3]) -> Rgb {
    srgb.map(|c| {
        let c = f32::from(c) / 255.0;
        if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    })
}

/// Linear light to an sRGB byte.
pub fn encode(c: f32) -> u8 {
    let c = c.clamp(0.0, 1.0);
    let s = if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
    (s * 255.0 + 0.5) as u8
}

/// The colour of "no value" (NaN).
pub const NO_VALUE: [u8; 3] = [150, 150, 155];

/// Stops of a blue - teal - yellow - orange - red scale: cool is stout, hot is slender. Lightness rises and falls once,
/// so that the order can be read without colours too.
const STOPS: [[u8; 3]; 8] = [
    [48, 58, 140],
    [41, 105, 176],
    [45, 155, 180],
    [120, 198, 155],
    [236, 224, 120],
    [246, 165, 70],
    [222, 85, 50],
    [150, 20, 50],
];

/// Maps values to colours between `min` and `max`, linearly or on a log axis; values outside take the end's colour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale {
    /// Value of the first colour.
    pub min: f64,
    /// Value of the last colour.
    pub max: f64,
    /// Equal ratios, not equal differences, get equal steps of colour. Needs `min > 0`.
    pub log: bool,
}

impl Scale {
    /// The range of the finite values. With `clip` in 0..0.5 that share at each end is left outside.
    pub fn of(values: &[f64], clip: f64, log: bool) -> Scale {
        let mut v: Vec<f64> = values.iter().copied().filter(|v| v.is_finite() && (!log || *v > 0.0)).collect();
        v.sort_by(f64::total_cmp);
        let Some(last) = v.len().checked_sub(1) else { return Scale { min: 0.0, max: 1.0, log: false } };
        let at = |q: f64| v[(q * last as f64).round() as usize];
        Scale { min: at(clip), max: at(1.0 - clip), log }
    }

    /// Position of `value` on the scale, 0..1.
    pub fn position(&self, value: f64) -> f64 {
        let f = |v: f64| if self.log { v.max(1e-300).ln() } else { v };
        let span = f(self.max) - f(self.min);
        if span > 0.0 { ((f(value) - f(self.min)) / span).clamp(0.0, 1.0) } else { 0.5 }
    }

    /// The value at `position` 0..1.
    pub fn value(&self, position: f64) -> f64 {
        if self.log {
            self.min * (self.max / self.min).powf(position)
        } else {
            self.min + (self.max - self.min) * position
        }
    }

    /// Colour of `value`; grey for NaN.
    pub fn color(&self, value: f64) -> Rgb {
        if value.is_nan() {
            return linear(NO_VALUE);
        }
        let x = self.position(value) * (STOPS.len() - 1) as f64;
        let k = (x as usize).min(STOPS.len() - 2);
        let t = (x - k as f64) as f32;
        let (a, b) = (linear(STOPS[k]), linear(STOPS[k + 1]));
        [0, 1, 2].map(|c| a[c] + t * (b[c] - a[c]))
    }
}

/// A colour for item `id` of a set (segments, features) that differs well from its neighbours in the list.
pub fn distinct(id: usize) -> [u8; 3] {
    const SET: [[u8; 3]; 12] = [
        [78, 121, 167],
        [242, 142, 43],
        [89, 161, 79],
        [225, 87, 89],
        [118, 183, 178],
        [237, 201, 72],
        [176, 122, 161],
        [255, 157, 167],
        [156, 117, 95],
        [134, 188, 182],
        [85, 85, 150],
        [180, 190, 90],
    ];
    let shade = 1.0 - 0.16 * ((id / SET.len()) % 4) as f64;
    SET[id % SET.len()].map(|c| (f64::from(c) * shade) as u8)
}

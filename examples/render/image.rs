//! A finished picture: 8-bit RGB with text, rectangles, pasting and PNG out.

use crate::palette::Scale;
use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};
use std::path::Path;

/// Pixels in rows, top left first.
#[derive(Debug, Clone)]
pub struct Image {
    pub width: usize,
    pub height: usize,
    pub pixels: Vec<[u8; 3]>,
}

/// Text size in pixels a line.
#[derive(Debug, Clone, Copy)]
pub enum Size {
    Small,
    Large,
}

const INK: [u8; 3] = [40, 44, 52];

impl Image {
    pub fn new(width: usize, height: usize, fill: [u8; 3]) -> Image {
        Image { width, height, pixels: vec![fill; width * height] }
    }

    fn blend(&mut self, x: i64, y: i64, color: [u8; 3], alpha: u8) {
        if x < 0 || y < 0 || x >= self.width as i64 || y >= self.height as i64 {
            return;
        }
        let p = &mut self.pixels[y as usize * self.width + x as usize];
        for c in 0..3 {
            let (a, b) = (u32::from(p[c]), u32::from(color[c]));
            p[c] = ((a * (255 - u32::from(alpha)) + b * u32::from(alpha) + 127) / 255) as u8;
        }
    }

    pub fn rect(&mut self, x: i64, y: i64, w: i64, h: i64, color: [u8; 3]) {
        for j in y..y + h {
            for i in x..x + w {
                self.blend(i, j, color, 255);
            }
        }
    }

    /// Writes `text` with its top left at (x, y) and returns its width in pixels.
    pub fn text(&mut self, x: i64, y: i64, text: &str, size: Size) -> i64 {
        let (height, weight) = match size {
            Size::Small => (RasterHeight::Size16, FontWeight::Regular),
            Size::Large => (RasterHeight::Size24, FontWeight::Regular),
        };
        let step = get_raster_width(weight, height) as i64;
        let mut at = x;
        for ch in text.chars() {
            if let Some(glyph) = get_raster(ch, weight, height).or_else(|| get_raster('?', weight, height)) {
                for (j, row) in glyph.raster().iter().enumerate() {
                    for (i, &alpha) in row.iter().enumerate() {
                        self.blend(at + i as i64, y + j as i64, INK, alpha);
                    }
                }
            }
            at += step;
        }
        at - x
    }

    /// Draws the legend of `scale`: a vertical bar with its ends and `ticks` inner values, and `title` above it.
    pub fn color_bar(&mut self, x: i64, y: i64, height: i64, scale: &Scale, title: &str, ticks: usize) {
        const WIDTH: i64 = 18;
        self.text(x, y - 28, title, Size::Small);
        self.rect(x - 1, y - 1, WIDTH + 2, height + 2, INK);
        for j in 0..height {
            let value = scale.value(1.0 - j as f64 / (height - 1).max(1) as f64);
            self.rect(x, y + j, WIDTH, 1, scale.color(value).map(crate::palette::encode));
        }
        for k in 0..ticks + 2 {
            let f = k as f64 / (ticks + 1) as f64;
            let at = y + ((1.0 - f) * (height - 1) as f64).round() as i64;
            self.rect(x + WIDTH, at, 5, 1, INK);
            self.text(x + WIDTH + 9, at - 8, &short(scale.value(f)), Size::Small);
        }
    }

    /// Copies `other` with its top left at (x, y).
    pub fn paste(&mut self, other: &Image, x: usize, y: usize) {
        for (j, row) in other.pixels.chunks_exact(other.width).enumerate() {
            for (i, &p) in row.iter().enumerate() {
                if x + i < self.width && y + j < self.height {
                    self.pixels[(y + j) * self.width + x + i] = p;
                }
            }
        }
    }

    /// Writes a PNG file.
    pub fn save(&self, path: &Path) -> Result<(), Box<dyn std::error::Error>> {
        let file = std::io::BufWriter::new(std::fs::File::create(path)?);
        let mut encoder = png::Encoder::new(file, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::High);
        encoder.write_header()?.write_image_data(self.pixels.as_flattened())?;
        Ok(())
    }
}

/// Three significant digits, no exponent for ordinary sizes.
pub fn short(v: f64) -> String {
    if v == 0.0 {
        return "0".into();
    }
    let digits = (2 - v.abs().log10().floor() as i64).clamp(0, 12) as usize;
    let text = if (1e-4..1e6).contains(&v.abs()) { format!("{v:.digits$}") } else { format!("{v:.2e}") };
    if text.contains('.') && !text.contains('e') {
        text.trim_end_matches('0').trim_end_matches('.').into()
    } else {
        text
    }
}

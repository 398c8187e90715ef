//! A small software rasteriser for pictures of triangle meshes: orthographic view, z-buffer, supersampling, smooth
//! shading with creases kept, ambient occlusion from the depth buffer, outlines and feature edges.

use crate::image::Image;
use crate::palette::{Rgb, Scale, distinct, encode, linear};
use rayon::prelude::*;
use std::collections::HashMap;

type V3 = [f64; 3];

/// What the surface is coloured by. NaN values are grey.
pub enum Paint<'a> {
    /// One value a vertex, mapped to colours per pixel.
    Vertex(&'a [f64], Scale),
    /// One value a face.
    Face(&'a [f64], Scale),
    /// One id a face, -1 = none.
    Id(&'a [i64]),
    /// One colour.
    Plain([u8; 3]),
}

/// Where the camera looks from: azimuth from +x towards +y and elevation above the xy plane, degrees. z is up.
#[derive(Debug, Clone, Copy)]
pub struct View {
    pub azimuth: f64,
    pub elevation: f64,
}

/// The frame: size in pixels and the part of it that the mesh may fill (left, top, width, height).
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    pub width: usize,
    pub height: usize,
    pub fit: [usize; 4],
}

const SAMPLES: usize = 3; // a side, 9 a pixel
const CREASE: f64 = 0.80; // cosine: faces that meet at more than 37 degrees keep their edge
pub const BACKGROUND: [u8; 3] = [255, 255, 255];

fn sub(a: V3, b: V3) -> V3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}
fn dot(a: V3, b: V3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
fn cross(a: V3, b: V3) -> V3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
fn unit(a: V3) -> V3 {
    let l = dot(a, a).sqrt();
    if l > 0.0 { a.map(|c| c / l) } else { [0.0; 3] }
}

impl View {
    /// Rows: right, up, towards the camera.
    fn axes(self) -> [V3; 3] {
        let (a, e) = (self.azimuth.to_radians(), self.elevation.to_radians());
        let towards = [e.cos() * a.cos(), e.cos() * a.sin(), e.sin()];
        let right = [-a.sin(), a.cos(), 0.0];
        [right, cross(towards, right), towards]
    }
}

/// Corner normals: the mean of the faces around the vertex that are within the crease angle of this corner's face.
fn corner_normals(positions: &[V3], triangles: &[[u32; 3]]) -> (Vec<V3>, Vec<[V3; 3]>) {
    let area: Vec<V3> = triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| positions[v as usize]);
            cross(sub(b, a), sub(c, a))
        })
        .collect();
    let mut around: Vec<Vec<u32>> = vec![Vec::new(); positions.len()];
    for (f, t) in triangles.iter().enumerate() {
        for &v in t {
            around[v as usize].push(f as u32);
        }
    }
    let face: Vec<V3> = area.iter().map(|&n| unit(n)).collect();
    let corners = (0..triangles.len())
        .into_par_iter()
        .map(|f| {
            triangles[f].map(|v| {
                let mut sum = [0.0; 3];
                for &g in &around[v as usize] {
                    if dot(face[f], face[g as usize]) > CREASE {
                        sum = [0, 1, 2].map(|k| sum[k] + area[g as usize][k]);
                    }
                }
                if dot(sum, sum) > 0.0 { unit(sum) } else { face[f] }
            })
        })
        .collect();
    (face, corners)
}

/// Edges that a draughtsman would draw: creases, boundaries and non-manifold edges; between ids, their borders.
fn drawn_edges(triangles: &[[u32; 3]], normals: &[V3], paint: &Paint<'_>) -> Vec<[u32; 2]> {
    let mut faces: HashMap<[u32; 2], Vec<u32>> = HashMap::new();
    for (f, t) in triangles.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            faces.entry([a.min(b), a.max(b)]).or_default().push(f as u32);
        }
    }
    let mut edges: Vec<[u32; 2]> = faces
        .into_iter()
        .filter(|(_, f)| match f[..] {
            [a, b] => {
                let (a, b) = (a as usize, b as usize);
                let border = matches!(paint, Paint::Id(ids) if ids[a] != ids[b]);
                border || dot(normals[a], normals[b]) < CREASE
            }
            _ => true,
        })
        .map(|(e, _)| e)
        .collect();
    edges.sort_unstable();
    edges
}

/// The samples of the frame: depth (towards the camera is larger), colour and view-space normal of what is seen.
struct Buffer {
    width: usize,
    height: usize,
    depth: Vec<f32>,
    color: Vec<Rgb>,
    normal: Vec<[f32; 3]>,
}

/// Draws the mesh on white.
pub fn render(positions: &[V3], triangles: &[[u32; 3]], paint: &Paint<'_>, view: View, frame: Frame) -> Image {
    // --- project: x right, y down, z towards the camera, in samples
    let axes = view.axes();
    let seen: Vec<V3> = positions.iter().map(|&p| axes.map(|a| dot(a, p))).collect();
    let used = || triangles.iter().flatten().map(|&v| seen[v as usize]);
    let low = used().fold([f64::INFINITY; 3], |m, p| [0, 1, 2].map(|k| m[k].min(p[k])));
    let high = used().fold([f64::NEG_INFINITY; 3], |m, p| [0, 1, 2].map(|k| m[k].max(p[k])));
    let s = SAMPLES as f64;
    let [left, top, w, h] = frame.fit.map(|v| v as f64 * s);
    let scale = (w / (high[0] - low[0]).max(1e-30)).min(h / (high[1] - low[1]).max(1e-30));
    let centre = [0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])];
    let screen: Vec<V3> = seen
        .iter()
        .map(|p| {
            let x = left + 0.5 * w + (p[0] - centre[0]) * scale;
            let y = top + 0.5 * h - (p[1] - centre[1]) * scale;
            [x, y, (p[2] - low[2]) * scale]
        })
        .collect();
    let (face, corners) = corner_normals(positions, triangles);

    // --- fill
    let mut buffer = Buffer::new(frame.width * SAMPLES, frame.height * SAMPLES);
    for f in 0..triangles.len() {
        let turned = corners[f].map(|n| axes.map(|a| dot(a, n)));
        let tint = Tint::of(paint, triangles[f], f);
        buffer.triangle(triangles[f].map(|v| screen[v as usize]), turned, &tint);
    }

    // --- shade, outline, edges, resolve
    let occlusion = buffer.occlusion();
    buffer.shade(&occlusion);
    buffer.outline();
    for [a, b] in drawn_edges(triangles, &face, paint) {
        buffer.line(screen[a as usize], screen[b as usize]);
    }
    buffer.resolve(frame)
}

/// Colour of one face: constant, or a value at each corner.
enum Tint {
    Flat(Rgb),
    Varying([f64; 3], Scale),
}

impl Tint {
    fn of(paint: &Paint<'_>, t: [u32; 3], f: usize) -> Tint {
        match paint {
            Paint::Vertex(values, scale) => Tint::Varying(t.map(|v| values[v as usize]), *scale),
            Paint::Face(values, scale) => Tint::Flat(scale.color(values[f])),
            Paint::Id(ids) => Tint::Flat(linear(usize::try_from(ids[f]).map_or(crate::palette::NO_VALUE, distinct))),
            Paint::Plain(color) => Tint::Flat(linear(*color)),
        }
    }

    fn at(&self, b: V3) -> Rgb {
        match self {
            Tint::Flat(c) => *c,
            // a corner without a value greys only its own share of the face
            Tint::Varying(v, scale) => {
                let main = (0..3).max_by(|&i, &j| b[i].total_cmp(&b[j])).unwrap_or(0);
                if v[main].is_nan() {
                    return scale.color(f64::NAN);
                }
                let (mut sum, mut weight) = (0.0, 0.0);
                for k in (0..3).filter(|&k| !v[k].is_nan()) {
                    sum += b[k] * v[k];
                    weight += b[k];
                }
                scale.color(sum / weight)
            }
        }
    }
}

impl Buffer {
    fn new(width: usize, height: usize) -> Buffer {
        let n = width * height;
        Buffer {
            width,
            height,
            depth: vec![f32::NEG_INFINITY; n],
            color: vec![linear(BACKGROUND); n],
            normal: vec![[0.0; 3]; n],
        }
    }

    fn triangle(&mut self, p: [V3; 3], normals: [V3; 3], tint: &Tint) {
        let area = (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[2][0] - p[0][0]) * (p[1][1] - p[0][1]);
        if area == 0.0 || !area.is_finite() {
            return;
        }
        let edge = |k: usize| {
            let v = p.map(|q| q[k]);
            let low = v.iter().copied().fold(f64::INFINITY, f64::min);
            let high = v.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            ((low - 0.5).ceil().max(0.0) as usize, (high - 0.5).floor())
        };
        let ((x0, x1), (y0, y1)) = (edge(0), edge(1));
        if x1 < 0.0 || y1 < 0.0 {
            return;
        }
        for y in y0..=(y1 as usize).min(self.height - 1) {
            for x in x0..=(x1 as usize).min(self.width - 1) {
                let q = [x as f64 + 0.5, y as f64 + 0.5];
                let part = |i: usize, j: usize| {
                    ((p[i][0] - q[0]) * (p[j][1] - q[1]) - (p[j][0] - q[0]) * (p[i][1] - q[1])) / area
                };
                let b = [part(1, 2), part(2, 0), part(0, 1)];
                if b.iter().any(|&v| v < 0.0) {
                    continue;
                }
                let mix = |v: [f64; 3]| b[0] * v[0] + b[1] * v[1] + b[2] * v[2];
                let z = mix(p.map(|q| q[2])) as f32;
                let at = y * self.width + x;
                if z > self.depth[at] {
                    let n = unit([0, 1, 2].map(|k| mix(normals.map(|n| n[k]))));
                    // an inside seen through a hole is lit like an outside
                    let n = if n[2] < 0.0 { n.map(|c| -c) } else { n };
                    self.depth[at] = z;
                    self.color[at] = tint.at(b);
                    self.normal[at] = n.map(|c| c as f32);
                }
            }
        }
    }

    /// How much of the sky each pixel (one sample of each) is denied by what stands around it, 0..1.
    fn occlusion(&self) -> Vec<f32> {
        let (w, h) = (self.width / SAMPLES, self.height / SAMPLES);
        let reach = (self.width.min(self.height) as f32 * 0.05).max(2.0);
        let taps: Vec<[f32; 2]> = (0..48)
            .map(|k| {
                let (r, a) = (reach * ((k as f32 + 0.5) / 48.0).powf(0.8), k as f32 * 2.399_963);
                [r * a.cos(), r * a.sin()]
            })
            .collect();
        let at = |x: i64, y: i64| {
            let inside = x >= 0 && y >= 0 && x < self.width as i64 && y < self.height as i64;
            inside.then(|| y as usize * self.width + x as usize).filter(|&i| self.depth[i].is_finite())
        };
        (0..w * h)
            .into_par_iter()
            .map(|i| {
                let (x, y) = ((i % w * SAMPLES + 1) as i64, (i / w * SAMPLES + 1) as i64);
                let Some(here) = at(x, y) else { return 0.0 };
                let n = self.normal[here];
                let mut sum = 0.0;
                for t in &taps {
                    let Some(there) = at(x + t[0] as i64, y + t[1] as i64) else { continue };
                    let d = [t[0], -t[1], self.depth[there] - self.depth[here]];
                    let l = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt().max(1e-6);
                    let lift = (d[0] * n[0] + d[1] * n[1] + d[2] * n[2]) / l - 0.12;
                    sum += lift.max(0.0) * (1.0 - l / (2.5 * reach)).max(0.0);
                }
                (sum / 16.0).min(1.0)
            })
            .collect()
    }

    /// Light from above left, a weaker one from the right, and the sky.
    fn shade(&mut self, occlusion: &[f32]) {
        let key = unit([-0.45, 0.65, 0.75]).map(|c| c as f32);
        let fill = unit([0.8, -0.1, 0.5]).map(|c| c as f32);
        let (width, w) = (self.width, self.width / SAMPLES);
        self.color.par_iter_mut().zip(&self.normal).zip(&self.depth).enumerate().for_each(|(i, ((c, n), z))| {
            if !z.is_finite() {
                return;
            }
            let lit = |l: [f32; 3]| (n[0] * l[0] + n[1] * l[1] + n[2] * l[2]).max(0.0);
            let open = 1.0 - 0.75 * occlusion[i / width / SAMPLES * w + i % width / SAMPLES];
            let light = (0.40 + 0.12 * n[1] + 0.56 * lit(key) + 0.16 * lit(fill)) * open;
            let glint = 0.10 * lit(key).powi(24) * open;
            *c = c.map(|v| (v * light * 1.08 + glint).min(1.0));
        });
    }

    /// Darkens samples behind which the depth falls away: the silhouette.
    fn outline(&mut self) {
        let jump = 0.012 * self.width.min(self.height) as f32;
        let (w, h) = (self.width, self.height);
        let dark: Vec<bool> = (0..w * h)
            .into_par_iter()
            .map(|i| {
                let (x, y, z) = (i % w, i / w, self.depth[i]);
                if !z.is_finite() {
                    return false;
                }
                // on a surface seen at a grazing angle depth changes fast without any jump
                let slope = 2.0 * SAMPLES as f32 / self.normal[i][2].max(0.05);
                [(x.wrapping_sub(1), y), (x + 1, y), (x, y.wrapping_sub(1)), (x, y + 1)]
                    .into_iter()
                    .any(|(u, v)| u < w && v < h && z - self.depth[v * w + u] > jump.max(slope))
            })
            .collect();
        for (c, d) in self.color.iter_mut().zip(dark) {
            if d {
                *c = c.map(|v| v * 0.22);
            }
        }
    }

    /// Draws a feature edge where the surface does not hide it, about a pixel wide.
    fn line(&mut self, a: V3, b: V3) {
        let d = sub(b, a);
        let steps = (d[0].abs().max(d[1].abs()) * 1.5).ceil().max(1.0);
        if !steps.is_finite() || steps > 1e6 {
            return;
        }
        let bias = 0.004 * self.width.min(self.height) as f64;
        for k in 0..=steps as usize {
            let p = [0, 1, 2].map(|c| a[c] + d[c] * k as f64 / steps);
            for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let (x, y) = (p[0].floor() as i64 + dx, p[1].floor() as i64 + dy);
                if x < 0 || y < 0 || x >= self.width as i64 || y >= self.height as i64 {
                    continue;
                }
                let at = y as usize * self.width + x as usize;
                if self.depth[at].is_finite() && p[2] + bias > f64::from(self.depth[at]) && self.normal[at] != [9.0; 3]
                {
                    self.color[at] = self.color[at].map(|v| v * 0.35);
                    self.normal[at] = [9.0; 3]; // inked: do not darken twice
                }
            }
        }
    }

    fn resolve(&self, frame: Frame) -> Image {
        let mut image = Image::new(frame.width, frame.height, BACKGROUND);
        let share = 1.0 / (SAMPLES * SAMPLES) as f32;
        image.pixels.par_iter_mut().enumerate().for_each(|(i, p)| {
            let (x, y) = (i % frame.width * SAMPLES, i / frame.width * SAMPLES);
            let mut sum = [0.0; 3];
            for j in 0..SAMPLES {
                for c in &self.color[(y + j) * self.width + x..][..SAMPLES] {
                    sum = [0, 1, 2].map(|k| sum[k] + c[k] * share);
                }
            }
            *p = sum.map(encode);
        });
        image
    }
}

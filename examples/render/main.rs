mod image;
mod palette;
mod raster;
use palette::Scale;
use raster::*;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let d = std::fs::read(&a[1]).unwrap();
    let n = u32::from_le_bytes(d[80..84].try_into().unwrap()) as usize;
    let mut map = std::collections::HashMap::new();
    let mut p: Vec<[f64; 3]> = vec![];
    let mut t = vec![];
    for f in 0..n {
        let r = &d[84 + 50 * f + 12..];
        t.push([0, 1, 2].map(|k| {
            let b = &r[12 * k..12 * k + 12];
            *map.entry(b.to_vec()).or_insert_with(|| {
                p.push([0, 1, 2].map(|c| f32::from_le_bytes(b[4 * c..4 * c + 4].try_into().unwrap()) as f64));
                p.len() as u32 - 1
            })
        }));
    }
    let mut e = std::collections::HashMap::new();
    for q in &t {
        for k in 0..3 {
            *e.entry((q[k], q[(k + 1) % 3])).or_insert(0) += 1;
        }
    }
    println!(
        "v {} f {} unmatched {}",
        p.len(),
        t.len(),
        e.iter().filter(|(k, v)| **v != 1 || e.get(&(k.1, k.0)) != Some(&1)).count()
    );
    let v: Vec<f64> = p.iter().map(|q| q[0] + q[2] * 2.0).collect();
    let s = Scale::of(&v, 0.0, false);
    let pl = Paint::Vertex(&v, s);
    let pp = Paint::Plain([120, 160, 200]);
    let mut i = render(
        &p,
        &t,
        if a.len() > 3 { &pp } else { &pl },
        View { azimuth: -60.0, elevation: 28.0 },
        Frame { width: 1200, height: 800, fit: [30, 30, 1020, 740] },
    );
    i.color_bar(1080, 80, 640, &s, "D1/D2", 3);
    i.text(20, 10, "bracket.stl", image::Size::Large);
    i.save(std::path::Path::new(&a[2])).unwrap();
}

//! How right and how fast D1 is on real parts, with its bounds:
//!
//! ```sh
//! cargo run --release --example d1_parts -- FOLDER_OR_PART ... [--tolerance 0.05] [--profile print|paper]
//! ```
//!
//! A part `NAME.stl` with exact values in `NAME.d1.json` (`"rows": [[x, y, z, d1], ...]`) is held against them: the largest
//! error, and the share of the values that lie within their vertex's bounds. Times are seconds by stage.

use armesh::field::{self, Options, Profile};
use armesh::geodesic::Mode;
use armesh::io::{self, Limits};
use armesh::job::{CancelToken, Job, Stage};
use armesh::mesh::{MeshOptions, TriMesh};
use std::path::{Path, PathBuf};

type Failure = Box<dyn std::error::Error>;

/// The numbers of `"rows": [[...], ...]`, four a row.
fn reference(part: &Path) -> Option<Vec<[f64; 4]>> {
    let text = std::fs::read_to_string(part.with_extension("d1.json")).ok()?;
    let rows = &text[text.find("\"rows\"")? + 6..];
    let number = |c: char| c.is_ascii_digit() || "+-.eE".contains(c);
    let values: Vec<f64> = rows.split(|c| !number(c)).filter_map(|w| w.parse().ok()).collect();
    Some(values.chunks_exact(4).map(|r| [r[0], r[1], r[2], r[3]]).collect())
}

fn parts(from: &Path) -> Result<Vec<PathBuf>, Failure> {
    if from.is_file() {
        return Ok(vec![from.to_path_buf()]);
    }
    let mut found = Vec::new();
    for entry in std::fs::read_dir(from)? {
        let path = entry?.path();
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("stl")) {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

fn percentile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(((values.len().max(1) - 1) as f64 * share).round() as usize).copied().unwrap_or(f64::NAN)
}

#[derive(Default)]
struct Totals {
    errors: Vec<f64>,
    seconds: Vec<f64>,
    held: usize,
    rows: usize,
}

fn measure(part: &Path, options: &Options, totals: &mut Totals) -> Result<(), Failure> {
    let started = std::time::Instant::now();
    let job = Job::new(0, None, CancelToken::default());
    let raw = io::load(part, &Limits::default(), &job)?;
    let mesh = TriMesh::new(&raw, &MeshOptions::default(), &job)?;
    let f = job.run(None, || field::compute(&mesh, options, &job))?;
    let seconds = started.elapsed().as_secs_f64();
    let gap = (0..f.d1.len()).map(|v| (f.d1_bounds.1[v] - f.d1_bounds.0[v]) / f.d1[v]).filter(|g| g.is_finite());
    let gap = gap.fold(0.0, f64::max);
    let name = part.file_stem().unwrap_or_default().to_string_lossy();
    let [d1, d2] = [Stage::Geodesic, Stage::Thickness].map(|s| f.seconds[s as usize]);
    let d1 = d1 + f.seconds[Stage::Factor as usize] + f.seconds[Stage::Surface as usize];
    print!(
        "{name:40.40} {:6} faces {:4} solves gap {gap:.3} stated error {:.4} D1 {d1:5.2} s D2 {d2:5.2} s",
        mesh.triangles().len(),
        f.solves,
        f.accuracy.error
    );
    totals.seconds.push(seconds);
    let (mut worst, mut held) = (0.0f64, 0);
    let rows = reference(part).unwrap_or_default();
    for row in &rows {
        let far = |p: &[f64; 3]| (0..3).map(|k| (p[k] - row[k]).powi(2)).sum::<f64>();
        let at = mesh.positions().iter().enumerate().map(|(v, p)| (far(p), v)).filter(|(_, v)| f.d1[*v].is_finite());
        let Some((_, v)) = at.reduce(|a, b| if b.0 < a.0 { b } else { a }) else { continue };
        worst = worst.max((f.d1[v] / row[3] - 1.0).abs());
        let rounding = 1e-6 * row[3];
        held += usize::from(f.d1_bounds.0[v] <= row[3] + rounding && row[3] <= f.d1_bounds.1[v] + rounding);
    }
    if rows.is_empty() {
        println!();
    } else {
        println!("  error {worst:.4}  bounds hold {held} of {}", rows.len());
        totals.errors.push(worst);
        totals.held += held;
        totals.rows += rows.len();
    }
    Ok(())
}

fn main() -> Result<(), Failure> {
    let (mut options, mut files) = (Options::default(), Vec::new());
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or(format!("{word} needs a value"));
        match word.as_str() {
            "--tolerance" => options.d1 = Mode::Certified { tolerance: value()?.parse()? },
            "--all" => options.d1 = Mode::AllSources,
            "--profile" if value()? == "paper" => options.profile = Profile::Paper,
            "--profile" => {}
            _ => files.extend(parts(Path::new(&word))?),
        }
    }
    let mut totals = Totals::default();
    for part in &files {
        if let Err(e) = measure(part, &options, &mut totals) {
            println!("{}: {e}", part.display());
        }
    }
    let (e, s) = (&mut totals.errors, &mut totals.seconds);
    let sum: f64 = s.iter().sum();
    println!(
        "largest error a part: median {:.4} p90 {:.4} worst {:.4}; seconds median {:.2} worst {:.2} total {sum:.1}; bounds hold {} of {}",
        percentile(e, 0.5),
        percentile(e, 0.9),
        percentile(e, 1.0),
        percentile(s, 0.5),
        percentile(s, 1.0),
        totals.held,
        totals.rows
    );
    Ok(())
}

//! Segments of a part as a table:
//!
//! ```sh
//! cargo run --release --example segment -- PART [--json REPORT.json] [--count N] [--method creases|paper|landmarks]
//! ```
//!
//! The report holds `face_feature`, the segment of every triangle of the file (-1: none), and `features` with `id`, `ratio` and more.

use armesh::io::{self, Limits};
use armesh::job::{CancelToken, Job};
use armesh::mesh::{MeshOptions, NONE, TriMesh};
use armesh::segment::{Criterion, Method, SegmentOptions, Segmentation, segment};
use std::io::Write;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut words = std::env::args().skip(1);
    let (mut part, mut report) = (String::new(), None);
    let mut options = SegmentOptions::default();
    let mut threads = 0;
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or(format!("{word} needs a value"));
        match word.as_str() {
            "--json" => report = Some(value()?),
            "--count" => options.count = Some(value()?.parse()?),
            "--threads" => threads = value()?.parse()?,
            "--no-measure" => options.measure = false,
            "--criterion" => {
                options.criterion = match value()?.as_str() {
                    "creases" => Criterion::Creases,
                    "eigengap" => Criterion::Eigengap,
                    "silhouette" => Criterion::Silhouette,
                    other => return Err(format!("unknown criterion {other}").into()),
                }
            }
            "--method" => {
                options.method = match value()?.as_str() {
                    "creases" => Method::Creases,
                    "paper" => Method::Paper,
                    "landmarks" => Method::Landmarks,
                    other => return Err(format!("unknown method {other}").into()),
                }
            }
            option if option.starts_with("--") => return Err(format!("unknown option {option}").into()),
            _ => part = word,
        }
    }
    let job = Job::new(threads, None, CancelToken::default());
    let (mesh, found, seconds) = job.run(None, || {
        let raw = io::load(part.as_ref(), &Limits::default(), &job)?;
        let mesh = TriMesh::new(&raw, &MeshOptions::default(), &job)?;
        let clock = std::time::Instant::now();
        let found = segment(&mesh, &options, &job)?;
        Ok((mesh, found, clock.elapsed().as_secs_f64()))
    })?;
    println!("{} faces, {} segments, {seconds:.2} s", mesh.triangles().len(), found.segments.len());
    println!("  #   faces      area    D1max    D2max     D2~    ratio  handles ring");
    for (k, s) in found.segments.iter().enumerate().take(40) {
        println!(
            "{k:3} {:7} {:9.2} {:8.2} {:8.3} {:7.3} {:8.2} {:8} {}",
            s.faces,
            s.area,
            s.d1_max,
            s.d2_max,
            s.d2_median,
            s.ratio_max,
            s.handles,
            if s.ring { "yes" } else { "" }
        );
    }
    if let Some(path) = report {
        write_report(&path, &mesh, &found)?;
    }
    Ok(())
}

fn write_report(path: &str, mesh: &TriMesh, found: &Segmentation) -> std::io::Result<()> {
    let number = |x: f64| if x.is_finite() { format!("{x}") } else { "null".into() };
    let mut out = std::io::BufWriter::new(std::fs::File::create(path)?);
    let faces: Vec<String> = (mesh.face_of_input().iter())
        .map(|&f| if f == NONE { "-1".into() } else { found.face_segment[f as usize].to_string() })
        .collect();
    write!(out, "{{\"face_feature\": [{}], \"features\": [", faces.join(","))?;
    for (k, s) in found.segments.iter().enumerate() {
        let separator = if k > 0 { "," } else { "" };
        let (ratio, typical) = (number(s.ratio_max), number(s.d1_max / s.d2_median));
        write!(
            out,
            "{separator}\n{{\"id\": {k}, \"ratio\": {ratio}, \"ratio_median\": {typical}, \"area\": {}}}",
            number(s.area)
        )?;
    }
    writeln!(out, "\n]}}")
}

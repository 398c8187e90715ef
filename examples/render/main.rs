//! Draws a part coloured by what armesh measures:
//!
//! ```sh
//! cargo run --release --example render -- PART OUT.png [--field ratio|d1|d2|face-d2|shell|segment|feature|plain] [--size 1200x800]
//!     [--view iso|front|back|left|right|top|bottom|AZIMUTH,ELEVATION] [--range MIN,MAX] [--log] [--title TEXT]
//! ```
//!
//! `--view` may be given several times: the views stand side by side. The pictures of the documentation are made by it. `raster.rs` draws any mesh with any colours and knows nothing of armesh.

mod image;
mod palette;
mod raster;

use armesh::feature::{FeatureOptions, find_features};
use armesh::field;
use armesh::io::{self, Limits};
use armesh::job::{CancelToken, Job};
use armesh::mesh::{MeshOptions, TriMesh};
use armesh::segment::{SegmentOptions, segment};
use image::{Image, Size};
use palette::Scale;
use raster::{Frame, Paint, View, render};
use std::path::Path;

type Failure = Box<dyn std::error::Error>;

/// What the command line asks for.
struct Args {
    part: String,
    out: String,
    field: String,
    views: Vec<View>,
    size: [usize; 2],
    range: Option<[f64; 2]>,
    log: bool,
    title: Option<String>,
}

fn pair<T: std::str::FromStr>(text: &str, separator: char) -> Result<[T; 2], Failure> {
    let wrong = || format!("'{text}' is not two numbers with '{separator}' between them");
    let (a, b) = text.split_once(separator).ok_or_else(wrong)?;
    Ok([a.parse().map_err(|_| wrong())?, b.parse().map_err(|_| wrong())?])
}

fn view(name: &str) -> Result<View, Failure> {
    let [azimuth, elevation] = match name {
        "iso" => [-60.0, 28.0],
        "front" => [-90.0, 0.0],
        "back" => [90.0, 0.0],
        "left" => [180.0, 0.0],
        "right" => [0.0, 0.0],
        "top" => [-90.0, 90.0],
        "bottom" => [-90.0, -90.0],
        other => pair(other, ',')?,
    };
    Ok(View { azimuth, elevation })
}

fn args() -> Result<Args, Failure> {
    let mut words = std::env::args().skip(1);
    let mut files = Vec::new();
    let mut args = Args {
        part: String::new(),
        out: String::new(),
        field: "ratio".into(),
        views: Vec::new(),
        size: [1200, 800],
        range: None,
        log: false,
        title: None,
    };
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or(format!("{word} needs a value"));
        match word.as_str() {
            "--field" => args.field = value()?,
            "--view" => args.views.push(view(&value()?)?),
            "--size" => args.size = pair(&value()?, 'x')?,
            "--range" => args.range = Some(pair(&value()?, ',')?),
            "--title" => args.title = Some(value()?),
            "--log" => args.log = true,
            option if option.starts_with("--") => return Err(format!("unknown option {option}").into()),
            _ => files.push(word),
        }
    }
    let [part, out] = <[String; 2]>::try_from(files).map_err(|_| "usage: render PART OUT.png [options]")?;
    if args.size.iter().any(|s| !(200..=8000).contains(s)) {
        return Err("the picture's sides are 200 to 8000 pixels".into());
    }
    if args.views.is_empty() {
        args.views.push(view("iso")?);
    }
    Ok(Args { part, out, ..args })
}

/// What the part is coloured by.
enum Colours {
    Plain,
    Shells(Vec<i64>),
    Vertices(Vec<f64>, &'static str),
    Faces(Vec<f64>, &'static str),
}

fn measure(args: &Args) -> Result<(TriMesh, Colours), Failure> {
    let job = Job::new(0, None, CancelToken::default());
    let mesh = job.run(None, || {
        let raw = io::load(Path::new(&args.part), &Limits::default(), &job)?;
        TriMesh::new(&(&raw.positions[..], &raw.triangles[..]), &MeshOptions::default(), &job)
    })?;
    let colours = match args.field.as_str() {
        "plain" => Colours::Plain,
        "shell" => Colours::Shells(mesh.topology()?.shell_of_face.iter().map(|&s| i64::from(s)).collect()),
        "feature" => {
            let job = Job::new(0, None, CancelToken::default());
            let found = job.run(None, || find_features(&mesh, &FeatureOptions::default(), &job))?;
            Colours::Shells(found.face_feature.iter().map(|&s| i64::from(s)).collect())
        }
        "segment" => {
            let job = Job::new(0, None, CancelToken::default());
            let options = SegmentOptions { measure: false, ..SegmentOptions::default() };
            let found = job.run(None, || segment(&mesh, &options, &job))?;
            Colours::Shells(found.face_segment.iter().map(|&s| i64::from(s)).collect())
        }
        name => {
            let job = Job::new(0, None, CancelToken::default());
            let found = job.run(None, || field::compute(&mesh, &field::Options::default(), &job))?;
            match name {
                "ratio" => Colours::Vertices(found.ratio, "D1/D2"),
                "d1" => Colours::Vertices(found.d1, "D1"),
                "d2" => Colours::Vertices(found.d2, "D2"),
                "face-d2" => Colours::Faces(found.face_d2, "D2"),
                other => {
                    return Err(format!(
                        "--field is ratio, d1, d2, face-d2, shell, segment, feature or plain, not {other}"
                    )
                    .into());
                }
            }
        }
    };
    Ok((mesh, colours))
}

fn run() -> Result<(), Failure> {
    let args = args()?;
    let (mesh, colours) = measure(&args)?;
    let scale = |values: &[f64]| match args.range {
        Some([min, max]) => Scale { min, max, log: args.log },
        // a few extreme vertices must not take all the colours
        None => Scale::of(values, 0.005, args.log),
    };
    let (paint, legend) = match &colours {
        Colours::Plain => (Paint::Plain([125, 160, 200]), None),
        Colours::Shells(ids) => (Paint::Id(ids), None),
        Colours::Vertices(values, name) => (Paint::Vertex(values, scale(values)), Some((scale(values), name))),
        Colours::Faces(values, name) => (Paint::Face(values, scale(values)), Some((scale(values), name))),
    };
    let [width, height] = args.size;
    let beside = if legend.is_some() { 150 } else { 0 };
    let above = if args.title.is_some() { 40 } else { 0 };
    let panel = (width - beside) / args.views.len();
    let margin = panel.min(height) / 25;
    let mut picture = Image::new(width, height, raster::BACKGROUND);
    for (k, &view) in args.views.iter().enumerate() {
        let fit = [margin, margin, panel - 2 * margin, height - above - 2 * margin];
        let frame = Frame { width: panel, height: height - above, fit };
        picture.paste(&render(mesh.positions(), mesh.triangles(), &paint, view, frame), k * panel, above);
    }
    if let Some((scale, name)) = legend {
        let bar = (height as i64 * 7 / 10).min(640);
        picture.color_bar((width - beside) as i64, (height as i64 - bar) / 2, bar, &scale, name, 3);
    }
    if let Some(title) = &args.title {
        picture.text(margin as i64, 14, title, Size::Large);
    }
    picture.save(Path::new(&args.out))
}

fn main() {
    if let Err(failure) = run() {
        eprintln!("render: {failure}");
        std::process::exit(2);
    }
}

//! Plots as SVG.

use plotters::prelude::*;
use std::error::Error;
use std::ops::Range;
use std::path::Path;

/// Points with a name. Without marks they are joined by a line.
pub struct Series {
    pub name: String,
    pub points: Vec<(f64, f64)>,
    pub marks: bool,
}

impl Series {
    pub fn marks(name: &str, points: impl IntoIterator<Item = (f64, f64)>) -> Series {
        Series { name: name.into(), points: points.into_iter().collect(), marks: true }
    }

    pub fn line(name: &str, points: impl IntoIterator<Item = (f64, f64)>) -> Series {
        Series { name: name.into(), points: points.into_iter().collect(), marks: false }
    }
}

/// What stands on and along the axes.
pub struct Axes<'a> {
    pub title: &'a str,
    pub x: &'a str,
    pub y: &'a str,
    pub log: bool,
}

const COLOURS: [RGBColor; 5] = [
    RGBColor(60, 60, 60),
    RGBColor(41, 105, 176),
    RGBColor(222, 85, 50),
    RGBColor(89, 161, 79),
    RGBColor(150, 110, 170),
];

/// Range of the values and a little around it.
fn range(values: impl Iterator<Item = f64>, log: bool) -> Range<f64> {
    let finite = values.filter(|v| v.is_finite());
    let (lo, hi) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(v), hi.max(v)));
    if log {
        lo / 1.5..hi * 1.5
    } else {
        let room = 0.06 * (hi - lo).max(1e-9);
        // a difference reads rightly only beside the whole
        (if lo > 0.0 && lo < 0.6 * hi { 0.0 } else { lo - room })..hi + room
    }
}

/// One diagram of several series.
pub fn diagram(path: &Path, axes: &Axes<'_>, series: &[Series]) -> Result<(), Box<dyn Error>> {
    let root = SVGBackend::new(path, (640, 420)).into_drawing_area();
    root.fill(&WHITE)?;
    let all = || series.iter().flat_map(|s| s.points.iter().copied());
    let (xs, ys) = (range(all().map(|p| p.0), axes.log), range(all().map(|p| p.1), axes.log));
    let mut builder = ChartBuilder::on(&root);
    builder.caption(axes.title, ("sans-serif", 17)).margin(12).x_label_area_size(38).y_label_area_size(58);
    // two types of axes, one way of drawing on them
    macro_rules! draw {
        ($chart:expr) => {{
            let mut chart = $chart;
            chart.configure_mesh().x_desc(axes.x).y_desc(axes.y).light_line_style(WHITE).draw()?;
            for (k, s) in series.iter().enumerate() {
                let colour = COLOURS[k % COLOURS.len()];
                let points = s.points.iter().copied().filter(|p| p.0.is_finite() && p.1.is_finite());
                let drawn = if s.marks {
                    chart.draw_series(points.map(|p| Circle::new(p, 4, colour.filled())))?
                } else {
                    chart.draw_series(LineSeries::new(points, colour.stroke_width(2)))?
                };
                let marks = s.marks;
                drawn.label(s.name.as_str()).legend(move |(x, y)| {
                    let r = if marks { 4 } else { 1 };
                    let x0 = if marks { x + 8 } else { x };
                    Rectangle::new([(x0, y - r), (x + 16, y + r)], colour.filled())
                });
            }
            chart.configure_series_labels().background_style(WHITE.mix(0.8)).border_style(BLACK.mix(0.3)).draw()?;
        }};
    }
    if axes.log {
        draw!(builder.build_cartesian_2d(xs.log_scale(), ys.log_scale())?);
    } else {
        draw!(builder.build_cartesian_2d(xs, ys)?);
    }
    root.present()?;
    Ok(())
}

/// A bar for every value, in the colour given with it.
pub fn bars(path: &Path, title: &str, y: &str, values: &[(f64, [u8; 3])]) -> Result<(), Box<dyn Error>> {
    let root = SVGBackend::new(path, (520, 300)).into_drawing_area();
    root.fill(&WHITE)?;
    let top = values.iter().map(|v| v.0).filter(|v| v.is_finite()).fold(0.0, f64::max);
    let mut chart = ChartBuilder::on(&root)
        .caption(title, ("sans-serif", 16))
        .margin(10)
        .x_label_area_size(30)
        .y_label_area_size(48)
        .build_cartesian_2d(0.0..values.len() as f64, 0.0..1.08 * top.max(1e-9))?;
    chart.configure_mesh().disable_x_mesh().x_labels(0).x_desc("segments").y_desc(y).light_line_style(WHITE).draw()?;
    let bar = |(k, &(value, [r, g, b])): (usize, &(f64, [u8; 3]))| {
        let (left, right) = (k as f64 + 0.12, k as f64 + 0.88);
        Rectangle::new([(left, 0.0), (right, value)], RGBColor(r, g, b).filled())
    };
    chart.draw_series(values.iter().enumerate().filter(|(_, v)| v.0.is_finite()).map(bar))?;
    root.present()?;
    Ok(())
}

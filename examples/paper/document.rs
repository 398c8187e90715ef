//! The page: tables with what the paper says, what is known exactly and what was measured, plots and pictures beside them.

use super::composites::Result22;
use super::palette::distinct;
use super::pictures;
use super::plots::{Axes, Series, bars, diagram};
use super::studies::{Closed, Coarse, Row};
use armesh::field::Quantity;
use std::error::Error;
use std::fmt::Write;
use std::path::{Path, PathBuf};

type Done = Result<(), Box<dyn Error>>;

/// The page as far as it is written, and the folder for what stands beside it.
pub struct Document {
    text: String,
    beside: PathBuf,
}

/// Three or four digits, or a dash.
fn number(v: f64) -> String {
    match v {
        v if !v.is_finite() => "-".into(),
        v if v.abs() >= 100.0 => format!("{v:.0}"),
        v if v.abs() >= 10.0 => format!("{v:.1}"),
        v => format!("{v:.3}"),
    }
}

fn percent(v: f64, truth: Option<f64>) -> String {
    truth.map_or(String::new(), |t| format!("{:+.1} %", 100.0 * (v / t - 1.0)))
}

impl Document {
    /// An empty page whose plots and pictures go to `beside`.
    pub fn new(beside: &Path) -> Result<Document, Box<dyn Error>> {
        std::fs::create_dir_all(beside)?;
        Ok(Document { text: String::new(), beside: beside.into() })
    }

    /// The page.
    pub fn finish(self) -> String {
        self.text
    }

    pub fn text(&mut self, paragraph: &str) {
        self.text += paragraph.trim_matches('\n');
        self.text += "\n\n";
    }

    fn image(&mut self, name: &str, words: &str) {
        let folder = self.beside.file_name().map_or_else(String::new, |f| f.to_string_lossy().into_owned());
        let _ = writeln!(self.text, "![{words}]({folder}/{name})\n");
    }

    /// One line a row: stated, exact, both profiles, both errors, and what of the paper profile's is that of D1 and of D2.
    pub fn table(&mut self, shape: &str, rows: &[Row]) {
        let _ = writeln!(
            self.text,
            "| {shape} | triangles | the paper says | exact | paper profile | error | of D1max | of D2max | print profile | error |\n\
             |---|--:|---|--:|--:|--:|--:|--:|--:|--:|"
        );
        for r in rows {
            let exact = r.exact.map_or(String::new(), number);
            let (e, f) = (percent(r.paper, r.exact), percent(r.print, r.exact));
            let [d1, d2] = [0, 1].map(|k| percent(r.paper_parts[k], r.exact_parts.map(|p| p[k])));
            let (paper, print) = (number(r.paper), number(r.print));
            let _ = writeln!(
                self.text,
                "| {} | {} | {} | {exact} | {paper} | {e} | {d1} | {d2} | {print} | {f} |",
                r.name, r.faces, r.stated
            );
        }
        self.text += "\n";
    }

    /// Both profiles' ratios, the closed form and a line of what the paper's measure stands for.
    pub fn plot(
        &mut self,
        name: &str,
        axes: &Axes<'_>,
        rows: &[Row],
        reference: Option<(&str, &dyn Fn(f64) -> f64)>,
    ) -> Done {
        let mut series = Vec::new();
        if let Some((label, of)) = reference {
            series.push(Series::line(label, rows.iter().map(|r| (r.x, of(r.x)))));
        }
        series.push(Series::marks("paper profile", rows.iter().map(|r| (r.x, r.paper))));
        series.push(Series::marks("print profile", rows.iter().map(|r| (r.x, r.print))));
        let exact = rows.iter().filter_map(|r| Some((r.x, r.exact?)));
        series.push(Series::line("exact", exact));
        series.iter_mut().for_each(|s| s.points.sort_by(|a, b| a.0.total_cmp(&b.0)));
        diagram(&self.beside.join(name), axes, &series)?;
        self.image(name, axes.title);
        Ok(())
    }

    /// Fig. 13: maxima and means against AR.
    pub fn squares(&mut self, rows: &[Row]) -> Done {
        let of = |name: &str, f: &dyn Fn(&Row) -> f64| Series::marks(name, rows.iter().map(|r| (r.x, f(r))));
        let mut by_aspect: Vec<(f64, f64)> = rows.iter().map(|r| (r.x, r.x)).collect();
        by_aspect.sort_by(|a, b| a.0.total_cmp(&b.0));
        let series = [
            Series::line("D1/D2 = AR", by_aspect),
            of("D1max/D2max, paper profile", &|r| r.paper),
            of("D1max/D2max, print profile", &|r| r.print),
            of("D1ave/D2ave, paper profile", &|r| r.paper_mean),
            of("D1ave/D2ave, print profile", &|r| r.print_mean),
        ];
        let axes = Axes { title: "Square shapes (Fig. 13)", x: "AR", y: "D1/D2", log: true };
        diagram(&self.beside.join("squares.svg"), &axes, &series)?;
        self.image("squares.svg", axes.title);
        let nearer = |of: &dyn Fn(&Row) -> [f64; 2]| {
            let off = |value: f64, aspect: f64| (value / aspect).ln().abs();
            rows.iter().filter(|r| off(of(r)[0], r.x) < off(of(r)[1], r.x)).count()
        };
        let (paper, print) = (nearer(&|r| [r.paper, r.paper_mean]), nearer(&|r| [r.print, r.print_mean]));
        let n = rows.len();
        self.text(&format!(
            "The maxima are nearer to AR than the means for {paper} of {n} shapes in the paper profile, {print} in the print profile."
        ));
        Ok(())
    }

    /// Fig. 11 and 12: fields and distributions.
    pub fn distributions(&mut self, shapes: &[(&str, super::measure::Measured)]) -> Done {
        let (_, rod) = shapes.last().ok_or("no shapes")?;
        pictures::by_vertex(&self.beside.join("rod-d1.png"), &rod.mesh, &rod.field.d1, "D1, mm", false)?;
        pictures::by_vertex(&self.beside.join("rod-d2.png"), &rod.mesh, &rod.field.d2, "D2, mm", false)?;
        self.image("rod-d1.png", "D1 on the rod (Fig. 11b)");
        self.image("rod-d2.png", "D2 on the rod (Fig. 11c)");
        for (quantity, name) in [(Quantity::D1, "D1"), (Quantity::D2, "D2")] {
            let mut series = Vec::new();
            for (shape, found) in shapes {
                let h = found.field.histogram(quantity, 16)?;
                let top = h.edges.last().copied().unwrap_or(1.0);
                let middle = |k: usize| 0.5 * (h.edges[k] + h.edges[k + 1]) / top;
                series.push(Series::line(shape, h.share.iter().enumerate().map(|(k, &s)| (middle(k), s))));
            }
            let title = format!("Distribution of {name} over the vertices (Fig. 12)");
            let x = format!("{name} / {name}max");
            let file = format!("distribution-{}.svg", name.to_lowercase());
            diagram(
                &self.beside.join(&file),
                &Axes { title: &title, x: &x, y: "share of the vertices", log: false },
                &series,
            )?;
            self.image(&file, &title);
        }
        Ok(())
    }

    /// Figs. 19 and 20: ratio by number of triangles.
    pub fn sensitivity(&mut self, shapes: &[(f64, Vec<Row>)]) -> Done {
        let mut series = Vec::new();
        for (l, rows) in shapes {
            let last = rows.last().map_or(f64::NAN, |r| r.paper);
            series.push(Series::line(&format!("l = {l} mm"), rows.iter().map(|r| (r.x, r.paper / last))));
        }
        let axes = Axes {
            title: "Mesh sensitivity, paper profile (Fig. 20)",
            x: "triangles",
            y: "D1max/D2max, to the finest",
            log: true,
        };
        diagram(&self.beside.join("sensitivity.svg"), &axes, &series)?;
        self.image("sensitivity.svg", axes.title);
        for (l, rows) in shapes {
            self.table(&format!("100 x 100 x {l} mm, N_mesh"), rows);
        }
        Ok(())
    }

    /// Angle of the cone against the wall's width.
    pub fn cones(&mut self, rows: &[[f64; 4]]) {
        self.text += "| full cone angle | D1max | D2max | D1max/D2max |\n|--:|--:|--:|--:|\n";
        for [cone, d1, d2, ratio] in rows {
            let _ = writeln!(self.text, "| {cone} degrees | {d1:.2} mm | {d2:.4} mm | {} |", number(*ratio));
        }
        self.text += "\n";
    }

    /// Raw and refined meshes of the same shapes.
    pub fn quality(&mut self, rows: &[Coarse]) {
        self.text += "| shape | triangles, raw | refined | print profile, raw | refined | change | paper profile, raw | refined | change |\n\
                      |---|--:|--:|--:|--:|--:|--:|--:|--:|\n";
        for r in rows {
            let _ = writeln!(
                self.text,
                "| {} | {} | {} | {} | {} | {} | {} | {} | {} |",
                r.name,
                r.faces[0],
                r.faces[1],
                number(r.print[0]),
                number(r.print[1]),
                percent(r.print[0], Some(r.print[1])),
                number(r.paper[0]),
                number(r.paper[1]),
                percent(r.paper[0], Some(r.paper[1])),
            );
        }
        self.text += "\n";
    }

    /// Rings and the bars that they were bent from.
    pub fn rings(&mut self, rows: &[Closed]) {
        self.text += "| shape | D1max/D2max open | closed | length around / D2max | told to be a ring |\n|---|--:|--:|--:|---|\n";
        for r in rows {
            let (open, closed, around) = (number(r.open), number(r.closed), number(r.around));
            let ring = if r.ring { "yes" } else { "no" };
            let _ = writeln!(self.text, "| {} | {open} | {closed} | {around} | {ring} |", r.name);
        }
        self.text += "\n";
    }

    /// Figs. 21 and 22: field, segments and the slenderness of each segment in its colour.
    pub fn composites(&mut self, parts: &[Result22]) -> Done {
        self.text += "| part | D1/D2 at the vertices (Fig. 21) | segments (Fig. 22a) | D1max/D2max of each (Fig. 22b) |\n|---|---|---|---|\n";
        let folder = self.beside.file_name().map_or_else(String::new, |f| f.to_string_lossy().into_owned());
        for p in parts {
            let file = |kind: &str| format!("{}-{kind}", p.part.key);
            let (mesh, found) = (&p.measured.mesh, &p.segmentation);
            pictures::by_vertex(&self.beside.join(file("field.png")), mesh, &p.measured.field.ratio, "D1/D2", true)?;
            pictures::by_segment(&self.beside.join(file("segments.png")), mesh, &found.face_segment)?;
            let values: Vec<(f64, [u8; 3])> =
                found.segments.iter().enumerate().map(|(k, s)| (s.ratio_max, distinct(k))).collect();
            bars(&self.beside.join(file("bars.svg")), p.part.name, "D1max/D2max", &values)?;
            let count = format!("{} of {}", found.segments.len(), p.part.features);
            let _ = write!(self.text, "| {}: {count} |", p.part.name);
            for kind in ["field.png", "segments.png", "bars.svg"] {
                let _ = write!(self.text, " ![{} {kind}]({folder}/{}) |", p.part.name, file(kind));
            }
            self.text += "\n";
        }
        self.text += "\n";
        Ok(())
    }
}

//! Wavefront OBJ: `v` and `f` lines; everything else does not shape a polygon mesh and is skipped.
//!
//! Groups, objects and materials are ignored, so that faces stay in file order.

use super::text::{Words, line_of, not_a_number, number, quote, skip_bom, trim_end};
use super::{Sink, format_error};
use crate::error::Result;

/// First words by which a text is taken for OBJ, whatever its name.
pub(super) const KEYWORDS: [&[u8]; 13] =
    [b"v", b"vn", b"vt", b"vp", b"f", b"fo", b"o", b"g", b"s", b"mtllib", b"usemtl", b"l", b"p"];
/// Lines between two looks at the job.
const STRIDE: usize = 1 << 14;

pub(super) fn parse(bytes: &[u8], sink: &mut Sink) -> Result<()> {
    let bytes = trim_end(bytes);
    let mut words = Words { bytes, at: skip_bom(bytes) };
    let (mut odd, mut lines) = (Odd::default(), 0usize);
    while words.at < bytes.len() {
        if lines % STRIDE == 0 {
            sink.at(words.at)?;
        }
        lines += 1;
        match words.next_in_line() {
            Some(b"v") => {
                let p = vertex(&mut words)?;
                sink.vertex(p)?;
            }
            // `fo` is what very old files have for `f`.
            Some(b"f" | b"fo") => face(&mut words, sink, &mut odd)?,
            Some(b"surf" | b"curv" | b"curv2") => sink.warn(|| at(&words, "free-form curves and surfaces are ignored")),
            Some(b"call") => return format_error(at(&words, "'call' of another file is not supported")),
            _ => (),
        }
        words.skip_line();
        words.at = (words.at + 1).min(bytes.len());
    }
    odd.report(bytes, sink);
    Ok(())
}

fn at(words: &Words, what: &str) -> String {
    format!("OBJ, line {}: {what}", words.line())
}

/// `v x y z [w] [r g b]`: the weight is for free-form surfaces, colours are not ours.
#[inline]
fn vertex(words: &mut Words) -> Result<[f64; 3]> {
    let mut p = [0.0; 3];
    for x in &mut p {
        let word = words.next_in_line();
        *x = match word.and_then(number) {
            Some(x) => x,
            None => return Err(not_a_number(word, format_args!("OBJ, line {}", words.line()))),
        };
    }
    Ok(p)
}

/// What is odd about the faces, with byte positions.
#[derive(Default)]
struct Odd {
    /// The largest index and where it stood: a face may name a vertex that comes later in the file.
    largest: (u32, usize),
    /// How many faces have fewer than three corners, and where the first of them is.
    short: (u64, usize),
}

impl Odd {
    fn report(&self, bytes: &[u8], sink: &mut Sink) {
        let n = sink.mesh.positions.len();
        let (largest, place) = self.largest;
        if place > 0 && largest as usize >= n {
            let line = line_of(bytes, place);
            sink.warn(|| format!("OBJ, line {line}: a face names vertex {}, there are {n}", largest as u64 + 1));
        }
        let (count, place) = self.short;
        if count > 0 {
            let line = line_of(bytes, place);
            sink.warn(|| format!("OBJ: {count} faces have fewer than three corners and are left out (line {line})"));
        }
    }
}

/// `f v v v ...` with corners `v`, `v/vt`, `v//vn` or `v/vt/vn`, as a fan around the first corner.
fn face(words: &mut Words, sink: &mut Sink, odd: &mut Odd) -> Result<()> {
    let mut fan = [0u32; 2];
    let mut n = 0u64;
    while let Some(word) = words.next_in_line() {
        let k = corner(word, sink.mesh.positions.len(), words)?;
        if k > odd.largest.0 || odd.largest.1 == 0 {
            odd.largest = (k, words.at);
        }
        match n {
            0 => fan[0] = k,
            1 => fan[1] = k,
            _ => {
                sink.triangle([fan[0], fan[1], k])?;
                fan[1] = k;
            }
        }
        n += 1;
    }
    if n < 3 {
        odd.short = (odd.short.0 + 1, if odd.short.0 == 0 { words.at } else { odd.short.1 });
    }
    Ok(())
}

/// The 0-based vertex of one corner; negative numbers count back from the last vertex so far.
#[inline]
fn corner(word: &[u8], vertices: usize, words: &Words) -> Result<u32> {
    let end = word.iter().position(|&b| b == b'/').unwrap_or(word.len());
    let index = match std::str::from_utf8(&word[..end]).ok().and_then(|w| w.parse::<i64>().ok()) {
        Some(i) if i > 0 => i - 1,
        Some(i) if i < 0 => vertices as i64 + i,
        Some(_) => return format_error(at(words, "vertex 0 in a face: OBJ counts from 1")),
        None => return format_error(at(words, &format!("{} is not the corner of a face", quote(word)))),
    };
    match u32::try_from(index) {
        Ok(i) if i < u32::MAX => Ok(i),
        _ if index < 0 => format_error(at(words, &format!("{} counts back beyond the first vertex", quote(word)))),
        _ => format_error(at(words, &format!("vertex {} is beyond 32-bit indices", quote(word)))),
    }
}

#[cfg(test)]
mod tests {
    use crate::error::Error;
    use crate::io::{Limits, RawMesh, Unit, parse};
    use crate::job::Job;

    fn read(text: &str) -> crate::error::Result<RawMesh> {
        parse(text.as_bytes(), "", &Limits::default(), &Job::default())
    }

    const SQUARE: &str = "# a square\nmtllib a.mtl\no square\nv 0 0 0\nv 1 0 0 1 0 0\nv 1 1 0.1 0.5 0.5 0.5\nv 0 1 0\n";

    #[test]
    fn every_form_of_a_corner() {
        let wanted = [[0, 1, 2], [0, 2, 3]];
        for face in [
            "f 1 2 3 4",
            "f 1/9 2/9 3/9 4/9",
            "f 1//7 2//7 3//7 4//7",
            "f 1/9/7 2/9/7 3/9/7 4/9/7",
            "f -4 -3 -2 -1",
            "f -4//-1 2 -2/1 4",
            "f 1 2 \\\n 3 4 # a comment",
            "f\t1  2 3\t4  ",
            "g a b\nusemtl red\ns off\nf 1 2 3\ng c\nf 1 3 4",
        ] {
            for text in [format!("{SQUARE}{face}\n"), format!("{SQUARE}{face}").replace('\n', "\r\n")] {
                let mesh = read(&text).unwrap();
                assert_eq!(mesh.triangles, wanted, "{face}");
                assert_eq!(mesh.positions, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.1], [0.0, 1.0, 0.0]]);
                assert_eq!((mesh.unit, mesh.warnings.len()), (Unit::Unknown, 0));
            }
        }
    }

    #[test]
    fn a_polygon_is_a_fan_in_place() {
        let mesh = read(&format!("{SQUARE}f 4 3 2\nf 1 2 3 4 4\nf 2 3 4")).unwrap();
        assert_eq!(mesh.triangles, [[3, 2, 1], [0, 1, 2], [0, 2, 3], [0, 3, 3], [1, 2, 3]]);
    }

    #[test]
    fn a_negative_corner_counts_from_where_it_stands() {
        let mesh = read("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 5 5 5\nf -3 -2 -1\n").unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2], [1, 2, 3]]);
    }

    #[test]
    fn a_vertex_that_is_missing_is_passed_on_with_a_warning() {
        let mesh = read(&format!("{SQUARE}f 1 2 9\nf 1 2")).unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 8]]);
        assert!(mesh.warnings[0].contains("line 8") && mesh.warnings[0].contains("vertex 9"), "{:?}", mesh.warnings);
        assert!(mesh.warnings[1].contains("1 faces") && mesh.warnings[1].contains("line 9"), "{:?}", mesh.warnings);
        // A later vertex may make it right.
        assert!(read(&format!("f 1 2 4\n{SQUARE}")).unwrap().warnings.is_empty());
    }

    #[test]
    fn damage_is_told_with_its_line() {
        for (line, wanted) in [
            ("f 0 1 2", "counts from 1"),
            ("f -5 1 2", "counts back beyond"),
            ("f 1 2 4294967296", "beyond 32-bit"),
            ("f 1 2 99999999999999999999", "not the corner"),
            ("f 1 2 x/1", "not the corner"),
            ("v 1,5 2 3", "decimal comma"),
            ("v 1 2", "a number is missing"),
            ("v 1 2 three", "'three' is not a number"),
        ] {
            match read(&format!("{SQUARE}f 1 2 3\n{line}\n")) {
                Err(Error::Format(m)) => assert!(m.contains(wanted) && m.contains("line 9"), "{m}"),
                other => panic!("{line}: {other:?}"),
            }
        }
    }

    #[test]
    fn vertices_alone_are_empty() {
        assert!(matches!(read(SQUARE), Err(Error::Empty(m)) if m.contains("4 vertices")));
    }
}

//! Results as coloured PLY: binary little endian, for MeshLab, ParaView and whatever else reads PLY.

use crate::error::{Error, Located, Result};
use std::io::{BufWriter, Write};
use std::path::Path;

/// Writes a PLY whose *vertices* have colours (`red green blue`) and named scalar fields (floats, NaN allowed).
///
/// `colours` and every field have one entry a position. A field named `quality` is what MeshLab takes for vertex
/// quality (to filter by or to colour anew); it drops fields of other names, and ParaView's own reader shows the colours only.
/// Programs that read every property (Open3D, CloudCompare, trimesh, meshio) see them all.
///
/// # Errors
/// [`Error::Argument`] (a length that does not fit, a name that is taken or not `[A-Za-z_][A-Za-z0-9_]*`),
/// [`Error::Index`] (a triangle names a position that does not exist), [`Error::Io`].
pub fn write_ply(
    out: &mut impl Write,
    positions: &[[f64; 3]],
    triangles: &[[u32; 3]],
    colours: Option<&[[u8; 3]]>,
    scalars: &[(&str, &[f64])],
) -> Result<()> {
    let plain = Paint { colours: None, scalars: &[] };
    write(out, positions, triangles, [Paint { colours, scalars }, plain])
}

/// [`write_ply`] with colours and fields per *triangle*: for segments, which end at edges.
pub fn write_face_ply(
    out: &mut impl Write,
    positions: &[[f64; 3]],
    triangles: &[[u32; 3]],
    colours: Option<&[[u8; 3]]>,
    scalars: &[(&str, &[f64])],
) -> Result<()> {
    let plain = Paint { colours: None, scalars: &[] };
    write(out, positions, triangles, [plain, Paint { colours, scalars }])
}

/// Creates (or replaces) the file at `path` and lets `body` write it, buffered:
/// `save_ply(path, |out| write_ply(out, ..))`.
/// After an error the file may be there in part.
pub fn save_ply(path: &Path, body: impl FnOnce(&mut BufWriter<std::fs::File>) -> Result<()>) -> Result<()> {
    let name = |e: std::io::Error| Error::Io(format!("{}: {e}", path.display()));
    let mut out = BufWriter::with_capacity(1 << 20, std::fs::File::create(path).map_err(name)?);
    body(&mut out).map_err(|e| match e {
        Error::Io(m) => Error::Io(format!("{}: {m}", path.display())),
        other => other,
    })?;
    out.flush().map_err(name)
}

/// What the rows of one element have besides their geometry.
#[derive(Clone, Copy)]
struct Paint<'a> {
    colours: Option<&'a [[u8; 3]]>,
    scalars: &'a [(&'a str, &'a [f64])],
}

impl Paint<'_> {
    fn check(&self, rows: usize, what: &str) -> Result<()> {
        let fits = |n: usize, name: &str| match n == rows {
            true => Ok(()),
            false => Err(Error::Argument(format!("PLY: {name} has {n} entries for {rows} {what}"))),
        };
        fits(self.colours.map_or(rows, <[_]>::len), "colours")?;
        const TAKEN: [&str; 8] = ["x", "y", "z", "red", "green", "blue", "vertex_indices", "vertex_index"];
        for (i, &(name, values)) in self.scalars.iter().enumerate() {
            fits(values.len(), name)?;
            let word = |b: u8| b.is_ascii_alphanumeric() || b == b'_';
            if !name.bytes().all(word) || name.bytes().next().is_none_or(|b| b.is_ascii_digit()) {
                return Err(Error::Argument(format!("PLY: '{name}' cannot name a field: letters, digits and _ only")));
            }
            if TAKEN.contains(&name) || self.scalars[..i].iter().any(|(other, _)| *other == name) {
                return Err(Error::Argument(format!("PLY: the name '{name}' is taken")));
            }
        }
        Ok(())
    }

    fn header(&self) -> String {
        let mut text = String::new();
        if self.colours.is_some() {
            text += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
        }
        for (name, _) in self.scalars {
            text += &format!("property float {name}\n");
        }
        text
    }

    fn row(&self, i: usize, bytes: &mut Vec<u8>) {
        if let Some(colours) = self.colours {
            bytes.extend(colours[i]);
        }
        for (_, values) in self.scalars {
            bytes.extend((values[i] as f32).to_le_bytes());
        }
    }
}

/// True if rounding to f32 moves a coordinate by more than a millionth of the mesh's size: so it does for a small part
/// far from the origin, whose picture would then show steps. Else floats, which every program reads and are half as long.
fn needs_double(positions: &[[f64; 3]]) -> bool {
    let finite = |p: &&[f64; 3]| p.iter().all(|x| x.is_finite());
    let (mut lo, mut hi, mut loss) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3], 0.0f64);
    for p in positions.iter().filter(finite) {
        for k in 0..3 {
            lo[k] = lo[k].min(p[k]);
            hi[k] = hi[k].max(p[k]);
            loss = loss.max((p[k] - p[k] as f32 as f64).abs());
        }
    }
    let size = (0..3).map(|k| hi[k] - lo[k]).fold(0.0, f64::max);
    loss > 1e-6 * size
}

fn write(out: &mut impl Write, positions: &[[f64; 3]], triangles: &[[u32; 3]], paint: [Paint; 2]) -> Result<()> {
    paint[0].check(positions.len(), "vertices")?;
    paint[1].check(triangles.len(), "triangles")?;
    let bad = |t: &&[u32; 3]| t.iter().any(|&v| v as usize >= positions.len());
    if let Some(first) = triangles.iter().position(|t| bad(&t)) {
        let count = triangles.iter().filter(bad).count() as u64;
        let message = format!("PLY: triangle {first} names a vertex that does not exist ({count} such triangles)");
        return Err(Error::Index(Located { message, first: first as u64, count }));
    }
    let io = |e: std::io::Error| Error::Io(e.to_string());
    let double = needs_double(positions);
    let real = if double { "double" } else { "float" };
    // Programs read `int` indices more reliably than `uint`, which is needed beyond 2^31 only.
    let index = if positions.len() > i32::MAX as usize { "uint" } else { "int" };
    let header = format!(
        "ply\nformat binary_little_endian 1.0\ncomment written by armesh {}\nelement vertex {}\nproperty {real} x\n\
         property {real} y\nproperty {real} z\n{}element face {}\n\
         property list uchar {index} vertex_indices\n{}end_header\n",
        env!("CARGO_PKG_VERSION"),
        positions.len(),
        paint[0].header(),
        triangles.len(),
        paint[1].header(),
    );
    out.write_all(header.as_bytes()).map_err(io)?;
    let mut row = Vec::new();
    for (i, p) in positions.iter().enumerate() {
        row.clear();
        for &x in p {
            if double { row.extend(x.to_le_bytes()) } else { row.extend((x as f32).to_le_bytes()) }
        }
        paint[0].row(i, &mut row);
        out.write_all(&row).map_err(io)?;
    }
    for (i, t) in triangles.iter().enumerate() {
        row.clear();
        row.push(3);
        t.iter().for_each(|v| row.extend(v.to_le_bytes()));
        paint[1].row(i, &mut row);
        out.write_all(&row).map_err(io)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::{Limits, parse};
    use crate::job::Job;

    const TRIANGLES: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];

    fn square(offset: f64) -> Vec<[f64; 3]> {
        [[0.0, 0.0, 0.25], [1.0, 0.0, 0.5], [1.0, 1.0, 0.0], [0.1, 1.0, 0.0]]
            .map(|p: [f64; 3]| p.map(|x| x + offset))
            .into()
    }

    #[test]
    fn what_is_written_reads_back() {
        for (offset, tolerance) in [(0.0, 1e-7), (1e7, 0.0)] {
            let positions = square(offset);
            for faces in [false, true] {
                let rows = if faces { 2 } else { 4 };
                let (colours, field) = (vec![[1, 2, 3]; rows], vec![f64::NAN; rows]);
                let scalars = [("d1", &field[..]), ("d1_over_d2", &field[..])];
                let mut out = Vec::new();
                let write = if faces { write_face_ply } else { write_ply };
                write(&mut out, &positions, &TRIANGLES, Some(&colours), &scalars).unwrap();
                let mesh = parse(&out, "", &Limits::default(), &Job::default()).unwrap();
                assert_eq!(mesh.triangles, TRIANGLES);
                for (p, q) in positions.iter().zip(&mesh.positions) {
                    assert!((0..3).all(|k| (p[k] - q[k]).abs() <= tolerance), "{p:?} {q:?}");
                }
            }
        }
    }

    #[test]
    fn the_bytes_are_those_of_the_format() {
        let mut out = Vec::new();
        let positions = [[0.5, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let field = [0.25, f64::NAN, 1e300];
        let colours = [[9, 8, 7], [0, 0, 0], [0, 0, 0]];
        write_ply(&mut out, &positions, &[[2, 1, 0]], Some(&colours), &[("ratio", &field)]).unwrap();
        let head = out.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
        let text = std::str::from_utf8(&out[..head]).unwrap();
        let wanted = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n\
            property uchar green\nproperty uchar blue\nproperty float ratio\nelement face 1\n\
            property list uchar int vertex_indices\nend_header\n";
        assert!(text.starts_with("ply\nformat binary_little_endian 1.0\n") && text.ends_with(wanted), "{text}");
        let data = &out[head..];
        assert_eq!(data.len(), 3 * 19 + 13);
        assert_eq!(data[..19], [0, 0, 0, 63, 0, 0, 0, 0, 0, 0, 0, 0, 9, 8, 7, 0, 0, 128, 62]);
        assert!(f32::from_le_bytes(data[34..38].try_into().unwrap()).is_nan());
        assert_eq!(data[57..], [3, 2, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0]);
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let (p, t) = (square(0.0), &TRIANGLES);
        let four = [0.0; 4];
        let refused = |colours, scalars: &[(&str, &[f64])]| {
            matches!(write_ply(&mut Vec::new(), &p, t, colours, scalars), Err(Error::Argument(_)))
        };
        assert!(!refused(None, &[("a", &four), ("_b2", &four)]));
        assert!(refused(Some(&[[0; 3]; 3]), &[]));
        assert!(refused(None, &[("a", &four[..3])]));
        for name in ["", "a b", "a\nelement", "2a", "x", "red", "gr\u{fc}n"] {
            assert!(refused(None, &[(name, &four)]), "{name:?}");
        }
        assert!(refused(None, &[("a", &four), ("a", &four)]));
        let bad = [[0, 1, 2], [0, 1, 4], [0, 1, u32::MAX]];
        match write_ply(&mut Vec::new(), &p, &bad, None, &[]) {
            Err(Error::Index(l)) => assert_eq!((l.first, l.count), (1, 2)),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_path_that_cannot_be_written_is_named() {
        let path = std::env::temp_dir().join("armesh-no-such-folder").join("a.ply");
        match save_ply(&path, |out| write_ply(out, &square(0.0), &TRIANGLES, None, &[])) {
            Err(Error::Io(m)) => assert!(m.contains("a.ply"), "{m}"),
            other => panic!("{other:?}"),
        }
    }
}

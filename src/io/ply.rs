//! PLY: ASCII and binary of both byte orders. Only the elements `vertex` (x, y, z) and `face` (the list of vertices)
//! are kept; other elements and properties are stepped over.

use super::ply_header::{Element, Encoding, Header, Property, Scalar, header};
use super::text::{Words, not_a_number, number, quote};
use super::{Sink, format_error};
use crate::error::Result;

/// Rows between two looks at the job.
const STRIDE: u64 = 1 << 14;

// --- values

/// One value after the other; all types fit an f64 exactly.
trait Values {
    fn value(&mut self, kind: Scalar) -> Result<f64>;
    fn skip(&mut self, kind: Scalar, n: u64) -> Result<()>;
    fn place(&self) -> usize;
}

struct Ascii<'a>(Words<'a>);

impl Values for Ascii<'_> {
    #[inline]
    fn value(&mut self, _: Scalar) -> Result<f64> {
        let word = self.0.next();
        match word.and_then(number) {
            Some(x) => Ok(x),
            None if word.is_none() => cut_off(),
            None => Err(not_a_number(word, format_args!("ASCII PLY, line {}", self.0.line()))),
        }
    }

    fn skip(&mut self, _: Scalar, n: u64) -> Result<()> {
        for _ in 0..n {
            if self.0.next().is_none() {
                return cut_off();
            }
        }
        Ok(())
    }

    fn place(&self) -> usize {
        self.0.at
    }
}

struct Binary<'a, const BIG: bool> {
    bytes: &'a [u8],
    at: usize,
}

impl<const BIG: bool> Binary<'_, BIG> {
    #[inline]
    fn take<const N: usize>(&mut self) -> Result<[u8; N]> {
        let Some(&(mut b)) = self.bytes[self.at..].first_chunk::<N>() else { return cut_off() };
        self.at += N;
        if BIG {
            b.reverse();
        }
        Ok(b)
    }
}

impl<const BIG: bool> Values for Binary<'_, BIG> {
    #[inline]
    fn value(&mut self, kind: Scalar) -> Result<f64> {
        Ok(match kind {
            Scalar::I8 => i8::from_le_bytes(self.take()?) as f64,
            Scalar::U8 => u8::from_le_bytes(self.take()?) as f64,
            Scalar::I16 => i16::from_le_bytes(self.take()?) as f64,
            Scalar::U16 => u16::from_le_bytes(self.take()?) as f64,
            Scalar::I32 => i32::from_le_bytes(self.take()?) as f64,
            Scalar::U32 => u32::from_le_bytes(self.take()?) as f64,
            Scalar::F32 => f32::from_le_bytes(self.take()?) as f64,
            Scalar::F64 => f64::from_le_bytes(self.take()?),
        })
    }

    fn skip(&mut self, kind: Scalar, n: u64) -> Result<()> {
        let bytes = kind.bytes().saturating_mul(n);
        if bytes > (self.bytes.len() - self.at) as u64 {
            return cut_off();
        }
        self.at += bytes as usize;
        Ok(())
    }

    fn place(&self) -> usize {
        self.at
    }
}

#[cold]
fn cut_off<T>() -> Result<T> {
    format_error("PLY: the file ends within its data: cut off?")
}

// --- elements

pub(super) fn parse(bytes: &[u8], sink: &mut Sink) -> Result<()> {
    let header = header(bytes)?;
    let at = header.end;
    match header.encoding {
        Encoding::Ascii => elements(&header, bytes, &mut Ascii(Words { bytes, at }), sink),
        Encoding::Little => elements(&header, bytes, &mut Binary::<false> { bytes, at }, sink),
        Encoding::Big => elements(&header, bytes, &mut Binary::<true> { bytes, at }, sink),
    }
}

fn elements(header: &Header, bytes: &[u8], values: &mut impl Values, sink: &mut Sink) -> Result<()> {
    let has = |name: &[u8]| header.elements.iter().any(|e| e.name == name);
    if !has(b"vertex") {
        return format_error("PLY: no element 'vertex'");
    }
    if !has(b"face") && has(b"tristrips") {
        return format_error("PLY: triangle strips are not supported, only faces");
    }
    let mut wanted = 1 + has(b"face") as u32;
    for element in &header.elements {
        if wanted == 0 {
            break;
        }
        plausible(element, header.encoding, bytes.len() - values.place())?;
        match element.name {
            b"vertex" => vertices(element, values, sink)?,
            b"face" => faces(element, values, sink)?,
            _ => others(element, values, sink)?,
        }
        wanted -= matches!(element.name, b"vertex" | b"face") as u32;
    }
    Ok(())
}

/// Refuses a count that the rest of the file cannot hold, before anything is reserved for it.
fn plausible(element: &Element, encoding: Encoding, left: usize) -> Result<()> {
    let row: u64 = match encoding {
        // A digit and a separator.
        Encoding::Ascii => 2 * element.properties.len() as u64,
        _ => element.properties.iter().map(|p| p.list.unwrap_or(p.kind).bytes()).sum(),
    };
    if row.saturating_mul(element.rows) > left as u64 + (encoding == Encoding::Ascii) as u64 {
        return format_error(format!(
            "PLY: the header says {} rows of {} with {row} bytes or more each, the file has {left} bytes left",
            element.rows,
            quote(element.name)
        ));
    }
    Ok(())
}

/// Steps over a property.
fn skip(p: &Property, values: &mut impl Values) -> Result<()> {
    match p.list {
        None => values.skip(p.kind, 1),
        Some(length) => {
            let n = list_length(values, length)?;
            values.skip(p.kind, n)
        }
    }
}

#[inline]
fn list_length(values: &mut impl Values, kind: Scalar) -> Result<u64> {
    let n = values.value(kind)?;
    if n >= 0.0 && n <= u32::MAX as f64 && n.fract() == 0.0 {
        Ok(n as u64)
    } else {
        format_error(format!("PLY: a list has the length {n}"))
    }
}

fn vertices(element: &Element, values: &mut impl Values, sink: &mut Sink) -> Result<()> {
    let mut slots = [usize::MAX; 3];
    for (slot, name) in slots.iter_mut().zip([b"x", b"y", b"z"]) {
        match element.properties.iter().position(|p| p.name == name && p.list.is_none()) {
            Some(i) => *slot = i,
            None => return format_error(format!("PLY: the vertices have no property {}", quote(name))),
        }
    }
    sink.reserve(element.rows, 0)?;
    for row in 0..element.rows {
        if row % STRIDE == 0 {
            sink.at(values.place())?;
        }
        let mut p = [0.0; 3];
        for (i, property) in element.properties.iter().enumerate() {
            match slots.iter().position(|&s| s == i) {
                Some(axis) => p[axis] = values.value(property.kind)?,
                None => skip(property, values)?,
            }
        }
        sink.vertex(p)?;
    }
    Ok(())
}

fn faces(element: &Element, values: &mut impl Values, sink: &mut Sink) -> Result<()> {
    let is_corners = |p: &Property| p.list.is_some() && matches!(p.name, b"vertex_indices" | b"vertex_index");
    let Some(corners) = element.properties.iter().position(is_corners) else {
        if element.rows == 0 {
            return Ok(());
        }
        return format_error("PLY: the faces have no list 'vertex_indices' (or 'vertex_index')");
    };
    sink.reserve(0, element.rows)?;
    let mut short = 0u64;
    for row in 0..element.rows {
        if row % STRIDE == 0 {
            sink.at(values.place())?;
        }
        for (i, property) in element.properties.iter().enumerate() {
            match property.list {
                Some(length) if i == corners => {
                    let n = list_length(values, length)?;
                    short += (n < 3) as u64;
                    fan(n, property.kind, values, sink)?;
                }
                _ => skip(property, values)?,
            }
        }
    }
    if short > 0 {
        sink.warn(|| format!("PLY: {short} faces have fewer than three corners and are left out"));
    }
    Ok(())
}

/// A face with `n` corners, as a fan around the first one.
#[inline]
fn fan(n: u64, kind: Scalar, values: &mut impl Values, sink: &mut Sink) -> Result<()> {
    let mut fan = [0u32; 2];
    for k in 0..n {
        let v = values.value(kind)?;
        // What no vertex can have (-1, 0.5, NaN) becomes u32::MAX, which no vertex has.
        let v = if v >= 0.0 && v < u32::MAX as f64 && v.fract() == 0.0 { v as u32 } else { u32::MAX };
        match k {
            0 => fan[0] = v,
            1 => fan[1] = v,
            _ => {
                sink.triangle([fan[0], fan[1], v])?;
                fan[1] = v;
            }
        }
    }
    Ok(())
}

fn others(element: &Element, values: &mut impl Values, sink: &mut Sink) -> Result<()> {
    // Rows without properties take no bytes, so that any count is plausible: there is nothing to step over.
    if element.properties.is_empty() {
        return Ok(());
    }
    for row in 0..element.rows {
        if row % STRIDE == 0 {
            sink.at(values.place())?;
        }
        for property in &element.properties {
            skip(property, values)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use crate::error::Error;
    use crate::io::{Limits, RawMesh, parse};
    use crate::job::Job;

    fn read(bytes: &[u8]) -> crate::error::Result<RawMesh> {
        parse(bytes, "", &Limits::default(), &Job::default())
    }

    fn message(bytes: &[u8]) -> String {
        match read(bytes) {
            Err(Error::Format(m)) => m,
            other => panic!("{other:?}"),
        }
    }

    const HEADER: &str = "comment vertex 7\nobj_info x\nelement camera 2\nproperty list uchar double view\n\
        property short id\nelement vertex 4\nproperty uchar red\nproperty float x\nproperty double y\n\
        property list int float weights\nproperty float32 z\nelement face 2\nproperty uint8 flags\n\
        property list ushort uint vertex_indices\nproperty float quality\nelement junk 1000000000000\nend_header\n";
    const POINTS: [[f64; 3]; 4] = [[0.0, 0.1, 0.5], [1.0, 0.1, 0.5], [1.0, 1e-9, 0.5], [0.0, 1.0, -2.0]];

    fn binary(big: bool) -> Vec<u8> {
        let mut out =
            format!("ply\nformat binary_{}_endian 1.0\n{HEADER}", if big { "big" } else { "little" }).into_bytes();
        let mut put = |mut b: Vec<u8>| {
            if big {
                b.reverse();
            }
            out.extend(b);
        };
        for n in [2u8, 0] {
            put(vec![n]);
            (0..n).for_each(|i| put((i as f64).to_le_bytes().to_vec()));
            put(7i16.to_le_bytes().to_vec());
        }
        for (i, p) in POINTS.iter().enumerate() {
            put(vec![0xff]);
            put((p[0] as f32).to_le_bytes().to_vec());
            put(p[1].to_le_bytes().to_vec());
            put((i as i32).to_le_bytes().to_vec());
            (0..i).for_each(|_| put(9f32.to_le_bytes().to_vec()));
            put((p[2] as f32).to_le_bytes().to_vec());
        }
        for face in [&[0u32, 1, 2, 3][..], &[2, 1, 0]] {
            put(vec![1]);
            put((face.len() as u16).to_le_bytes().to_vec());
            face.iter().for_each(|v| put(v.to_le_bytes().to_vec()));
            put(f32::NAN.to_le_bytes().to_vec());
        }
        out
    }

    fn ascii() -> String {
        format!(
            "ply\nformat ascii 1.0\n{HEADER}2 0 1 7\n0 7\n255 0 0.1 0 0.5\n255 1 0.1 1 9 0.5\n255 1 1e-9 2 9 9 0.5\n\
             255 0 1 3 9 9 9 -2\n1 4 0 1 2 3 nan\n1 3 2 1 0 nan\n"
        )
    }

    #[test]
    fn every_encoding_with_other_elements_and_properties() {
        let files = [ascii().into_bytes(), ascii().replace('\n', "\r\n").into_bytes(), binary(false), binary(true)];
        for file in files {
            let mesh = read(&file).unwrap();
            assert_eq!(mesh.positions, POINTS);
            assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [2, 1, 0]]);
            assert!(mesh.warnings.is_empty());
        }
    }

    #[test]
    fn a_binary_header_of_any_line_ending() {
        // The first data byte is a line feed: it must not be taken for the second half of CR LF.
        for ending in ["\n", "\r\n", "\r"] {
            let header = "ply\nformat binary_little_endian 1.0\nelement face 1\nproperty uchar flag\n\
                property list uchar uchar vertex_index\nelement vertex 1\nproperty char x\nproperty char y\n\
                property char z\nend_header\n";
            let mut file = header.replace('\n', ending).into_bytes();
            file.extend([10, 3, 0, 0, 0, 10, 13, 255]);
            let mesh = read(&file).unwrap();
            assert_eq!((mesh.positions, mesh.triangles), (vec![[10.0, 13.0, -1.0]], vec![[0, 0, 0]]));
        }
    }

    #[test]
    fn a_count_beyond_the_file_is_refused_before_allocating() {
        for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
            for (vertices, faces) in [("1000000000000", "1"), ("1", "1000000000000"), ("18446744073709551615", "1")] {
                let m = message(
                    format!(
                        "ply\nformat {format} 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\n\
                         property float z\nelement face {faces}\nproperty list uchar int vertex_index\nend_header\n\
                         1 2 3 4 5 6 7 8 9"
                    )
                    .as_bytes(),
                );
                assert!(m.contains("000000000") || m.contains("18446744073709551615"), "{m}");
                assert!(m.contains("bytes left"), "{m}");
            }
        }
    }

    #[test]
    fn indices_that_no_vertex_has_are_passed_on() {
        let text = ascii().replace("1 4 0 1 2 3 nan", "1 4 -1 1 77 0.5 nan");
        assert_eq!(read(text.as_bytes()).unwrap().triangles[..2], [[u32::MAX, 1, 77], [u32::MAX, 77, u32::MAX]]);
    }

    #[test]
    fn a_point_cloud_is_empty_and_short_faces_are_told() {
        let cloud = "ply\nformat ascii 1.0\nelement vertex 1\nproperty int x\nproperty int y\nproperty int z\nend_header\n1 2 3";
        assert!(matches!(read(cloud.as_bytes()), Err(Error::Empty(m)) if m.contains("1 vertices")));
        let mesh = read(ascii().replace("1 4 0 1 2 3 nan", "1 2 0 1 nan").as_bytes()).unwrap();
        assert_eq!((mesh.triangles.len(), mesh.warnings.len()), (1, 1));
    }

    #[test]
    fn damage_is_told() {
        for (from, to, wanted) in [
            ("ascii 1.0", "asci 1.0", "unknown format"),
            ("format ascii 1.0\n", "", "no 'format'"),
            ("end_header", "end_of_header", "unknown word"),
            ("float32 z", "float32 w", "no property 'z'"),
            ("float32 z", "quad z", "unknown type"),
            ("ushort uint vertex", "float uint vertex", "no integer type"),
            ("element camera 2", "element camera -2", "no whole number"),
            ("element camera 2", "element vertex 2", "a second element"),
            ("vertex_indices", "corners", "no list 'vertex_indices'"),
            ("element face 2", "element tristrips 2", "strips are not supported"),
            ("element vertex 4", "element vertices 4", "no element 'vertex'"),
            ("255 0 0.1 0 0.5", "255 0 0,1 0 0.5", "line 22: '0,1' has a decimal comma"),
            ("1 4 0 1 2 3", "1 -4 0 1 2 3", "length -4"),
            ("1 3 2 1 0 nan", "1 3 2", "cut off"),
        ] {
            let m = message(ascii().replacen(from, to, 1).as_bytes());
            assert!(m.contains(wanted), "{to}: {m}");
        }
    }
}

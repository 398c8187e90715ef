//! STL, binary and ASCII.
//!
//! A binary file may begin with "solid" and an ASCII file need not end with "endsolid", so the size rule of binary STL
//! (84 bytes and 50 a triangle) decides first, then whether the bytes are text. Normals and attribute bytes (which some
//! programs use for colours) are ignored: the corners say all.

use super::text::{Words, is_text, not_a_number, number, quote, skip_bom, trim_end};
use super::{Sink, format_error};
use crate::error::Result;

const HEADER: usize = 84;
const RECORD: usize = 50;
/// Triangles between two looks at the job.
const STRIDE: usize = 1 << 14;

/// The number of triangles in the header of a binary file.
fn claimed(bytes: &[u8]) -> Option<u64> {
    bytes.get(80..HEADER).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as u64)
}

/// True if the size of the file is what its binary header says, or that and less than a triangle's bytes more.
pub(super) fn is_binary(bytes: &[u8]) -> bool {
    claimed(bytes).is_some_and(|n| {
        let extra = (bytes.len() - HEADER) as u64;
        extra == n * RECORD as u64 || (n > 0 && extra > n * 50 && extra < (n + 1) * 50 && !is_text(bytes))
    })
}

pub(super) fn parse(bytes: &[u8], sink: &mut Sink) -> Result<()> {
    if !is_binary(bytes) && is_text(bytes) { ascii(trim_end(bytes), sink) } else { binary(bytes, sink) }
}

fn binary(bytes: &[u8], sink: &mut Sink) -> Result<()> {
    let Some(count) = claimed(bytes) else {
        return format_error(format!(
            "neither ASCII STL nor binary STL: {} bytes, and a binary header alone has {HEADER}",
            bytes.len()
        ));
    };
    let extra = bytes.len() - HEADER;
    let room = extra / RECORD;
    if count > room as u64 {
        return format_error(format!(
            "binary STL: the header says {count} triangles, the file of {} bytes holds {room}: cut off, or no STL",
            bytes.len()
        ));
    }
    let count = count as usize;
    let rest = extra - count * RECORD;
    // Whole triangles behind the last one: the count may be what is wrong (some programs leave it 0), and dropping
    // triangles silently changes the part. Anything else is a footer.
    if rest > 0 && rest % RECORD == 0 {
        return format_error(format!(
            "binary STL: the header says {count} triangles, the file of {} bytes holds {room}",
            bytes.len()
        ));
    }
    if rest > 0 {
        sink.warn(|| format!("{rest} bytes behind the {count} triangles of the binary STL are ignored"));
    }
    sink.reserve(3 * count as u64, count as u64)?;
    for (i, block) in bytes[HEADER..HEADER + count * RECORD].chunks(STRIDE * RECORD).enumerate() {
        sink.at(HEADER + i * STRIDE * RECORD)?;
        for record in block.chunks_exact(RECORD) {
            // 12 bytes of normal, 36 bytes of corners, 2 bytes of attribute.
            let x =
                |k: usize| f32::from_le_bytes([record[12 + k], record[13 + k], record[14 + k], record[15 + k]]) as f64;
            soup(sink, [[x(0), x(4), x(8)], [x(12), x(16), x(20)], [x(24), x(28), x(32)]])?;
        }
    }
    Ok(())
}

#[inline]
fn soup(sink: &mut Sink, corners: [[f64; 3]; 3]) -> Result<()> {
    // `Sink::vertex` keeps the number of vertices below u32::MAX.
    for p in corners {
        sink.vertex(p)?;
    }
    let n = sink.mesh.positions.len() as u32;
    sink.triangle([n - 3, n - 2, n - 1])
}

fn ascii(bytes: &[u8], sink: &mut Sink) -> Result<()> {
    let mut words = Words { bytes, at: skip_bom(bytes) };
    let mut open = false;
    while let Some(word) = words.next() {
        if is(word, "facet") {
            if sink.mesh.triangles.len() % STRIDE == 0 {
                sink.at(words.at)?;
            }
            let corners = facet(&mut words)?;
            soup(sink, corners)?;
        } else if is(word, "solid") || is(word, "endsolid") {
            open = is(word, "solid");
            // The rest of the line is a name, which may have any words in it.
            words.skip_line();
        } else if word.starts_with(b"#") {
            words.skip_line();
        } else {
            return unexpected(&words, Some(word), "'facet' or 'endsolid'");
        }
    }
    if open {
        sink.warn(|| "the ASCII STL has no 'endsolid': it may have been cut off between two facets".into());
    }
    Ok(())
}

/// What follows the word `facet`.
fn facet(words: &mut Words) -> Result<[[f64; 3]; 3]> {
    // The normal is not read: it is often zero or NaN, and the corners have a normal.
    for _ in 0..5 {
        let before = words.clone();
        if words.next().is_some_and(|w| is(w, "outer")) {
            *words = before;
            break;
        }
    }
    expect(words, "outer")?;
    expect(words, "loop")?;
    let mut corners = [[0.0; 3]; 3];
    for corner in &mut corners {
        expect(words, "vertex")?;
        for x in corner {
            let word = words.next();
            *x = match word.and_then(number) {
                Some(x) => x,
                None => return Err(not_a_number(word, format_args!("ASCII STL, line {}", words.line()))),
            };
        }
    }
    let word = words.next();
    if word.is_some_and(|w| is(w, "vertex")) {
        return format_error(format!("ASCII STL, line {}: a facet with more than three vertices", words.line()));
    }
    if !word.is_some_and(|w| is(w, "endloop")) {
        return unexpected(words, word, "'endloop'");
    }
    expect(words, "endfacet")?;
    Ok(corners)
}

#[inline]
fn is(word: &[u8], keyword: &str) -> bool {
    word.eq_ignore_ascii_case(keyword.as_bytes())
}

#[inline]
fn expect(words: &mut Words, keyword: &str) -> Result<()> {
    match words.next() {
        Some(w) if is(w, keyword) => Ok(()),
        w => unexpected(words, w, &format!("'{keyword}'")),
    }
}

#[cold]
fn unexpected<T>(words: &Words, word: Option<&[u8]>, wanted: &str) -> Result<T> {
    let line = words.line();
    format_error(match word {
        None => format!("ASCII STL, line {line}: the file ends where {wanted} should be: cut off?"),
        Some(w) => format!("ASCII STL, line {line}: {} where {wanted} should be", quote(w)),
    })
}

#[cfg(test)]
mod tests {
    use crate::error::Error;
    use crate::io::{Limits, RawMesh, parse};
    use crate::job::Job;

    fn read(bytes: &[u8]) -> crate::error::Result<RawMesh> {
        parse(bytes, "stl", &Limits::default(), &Job::default())
    }

    fn message(bytes: &[u8]) -> String {
        match read(bytes) {
            Err(Error::Format(m)) => m,
            other => panic!("{other:?}"),
        }
    }

    /// A binary file whose corner k of triangle i is (i, k, 0.1f32).
    fn binary(header: &[u8], n: u32) -> Vec<u8> {
        let mut bytes = header.to_vec();
        bytes.resize(80, b' ');
        bytes.extend(n.to_le_bytes());
        for i in 0..n {
            bytes.extend([0u8; 12]);
            for k in 0..3 {
                for x in [i as f32, k as f32, 0.1f32] {
                    bytes.extend(x.to_le_bytes());
                }
            }
            bytes.extend([0xff, 0x7f]);
        }
        bytes
    }

    const TEXT: &str = "solid a facet of life\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1.5 0 0\n   \
        vertex 0 1e0 0.1\n  endloop\n endfacet\nendsolid a facet of life\n";

    #[test]
    fn binary_even_if_it_begins_with_solid() {
        for header in [&b"solid cube"[..], b"", b"COLOR=\x01\x02\x03\xff,MATERIAL="] {
            let mesh = read(&binary(header, 5)).unwrap();
            assert_eq!(mesh.triangles.len(), 5);
            assert_eq!(mesh.triangles[4], [12, 13, 14]);
            assert_eq!(mesh.positions[14], [4.0, 2.0, 0.1f32 as f64]);
            assert!(mesh.warnings.is_empty());
        }
    }

    #[test]
    fn a_count_that_lies_is_told_with_both_figures() {
        let mut bytes = binary(b"", 4);
        bytes[80..84].copy_from_slice(&1_000_000_000u32.to_le_bytes());
        let m = message(&bytes);
        assert!(m.contains("1000000000 triangles") && m.contains("holds 4"), "{m}");
        for small in [0u32, 3] {
            bytes[80..84].copy_from_slice(&small.to_le_bytes());
            let m = message(&bytes);
            assert!(m.contains(&format!("says {small} triangles")) && m.contains("holds 4"), "{m}");
        }
    }

    #[test]
    fn trailing_bytes_are_a_warning() {
        for extra in [1, 49, 51, 77] {
            let mut bytes = binary(b"solid", 4);
            bytes.resize(bytes.len() + extra, 7);
            let mesh = read(&bytes).unwrap();
            assert_eq!(mesh.triangles.len(), 4);
            assert!(mesh.warnings[0].contains(&format!("{extra} bytes")), "{:?}", mesh.warnings);
        }
    }

    #[test]
    fn ascii_in_every_dress() {
        let plain = read(TEXT.as_bytes()).unwrap();
        assert_eq!(plain.positions, [[0.0, 0.0, 0.0], [1.5, 0.0, 0.0], [0.0, 1.0, 0.1]]);
        assert_eq!(plain.triangles, [[0, 1, 2]]);
        assert!(plain.warnings.is_empty());
        for dressed in [
            TEXT.replace('\n', "\r\n"),
            TEXT.replace('\n', "\r"),
            TEXT.to_uppercase(),
            TEXT.replace(' ', " \t "),
            format!("\u{feff}# written by hand\n{TEXT}"),
            format!("\n\n  {TEXT}\0\0\x1a"),
            TEXT.replace("normal 0 0 1", "normal nan -nan(ind) 0,5"),
            TEXT.replace("normal 0 0 1", ""),
            TEXT.replace("a facet of life", ""),
            TEXT.replace("solid a facet of life", "solid caf\u{e9}"),
        ] {
            assert_eq!(read(dressed.as_bytes()).as_ref(), Ok(&plain), "{dressed:?}");
        }
    }

    #[test]
    fn several_solids_are_one_mesh() {
        let mesh = read(format!("{TEXT}{TEXT}\n{TEXT}").as_bytes()).unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2], [3, 4, 5], [6, 7, 8]]);
    }

    #[test]
    fn a_decimal_comma_is_told_with_its_line() {
        let m = message(TEXT.replace("1.5", "1,5").as_bytes());
        assert!(m.contains("line 5") && m.contains("'1,5'") && m.contains("decimal comma"), "{m}");
    }

    #[test]
    fn damage_is_told_with_its_line() {
        for (from, to, wanted) in [
            ("vertex 1.5 0 0", "vertex 1.5 0", "line 6"),
            ("vertex 1.5", "vertex x", "line 5: 'x' is not a number"),
            ("endloop", "vertex 1 1 1 endloop", "line 7: a facet with more than three"),
            (" endfacet\n", "", "line 8: 'endsolid' where 'endfacet'"),
            ("facet normal", "facit normal", "line 2: 'facit'"),
        ] {
            let m = message(TEXT.replacen(from, to, 1).as_bytes());
            assert!(m.contains(wanted), "{m}");
        }
        assert!(message(&TEXT.as_bytes()[..TEXT.find("vertex 1.5").unwrap()]).contains("ends where"));
    }

    #[test]
    fn an_ascii_file_cut_between_facets_is_a_warning() {
        let cut = TEXT.find("endsolid").unwrap();
        let mesh = read(&TEXT.as_bytes()[..cut]).unwrap();
        assert_eq!((mesh.triangles.len(), mesh.warnings.len()), (1, 1));
    }

    #[test]
    fn no_triangles_is_empty() {
        assert!(matches!(read(b"solid a\nendsolid a\n"), Err(Error::Empty(_))));
        assert!(matches!(read(&binary(b"x", 0)), Err(Error::Empty(_))));
    }
}

//! The header of a PLY file: which elements there are, with which properties, and how the data is encoded.

use super::format_error;
use super::text::{Words, quote, skip_bom};
use crate::error::Result;

/// More than any program writes, and few enough for linear searches.
const MAX_ELEMENTS: usize = 1000;
const MAX_PROPERTIES: usize = 10_000;

/// The types of values; each has an old and a new name.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn named(name: &[u8]) -> Option<Scalar> {
        Some(match name {
            b"char" | b"int8" => Scalar::I8,
            b"uchar" | b"uint8" => Scalar::U8,
            b"short" | b"int16" => Scalar::I16,
            b"ushort" | b"uint16" => Scalar::U16,
            b"int" | b"int32" => Scalar::I32,
            b"uint" | b"uint32" => Scalar::U32,
            b"float" | b"float32" => Scalar::F32,
            b"double" | b"float64" => Scalar::F64,
            _ => return None,
        })
    }

    pub(super) fn bytes(self) -> u64 {
        match self {
            Scalar::I8 | Scalar::U8 => 1,
            Scalar::I16 | Scalar::U16 => 2,
            Scalar::I32 | Scalar::U32 | Scalar::F32 => 4,
            Scalar::F64 => 8,
        }
    }
}

pub(super) struct Property<'a> {
    pub name: &'a [u8],
    pub kind: Scalar,
    /// For a list: the type of its length.
    pub list: Option<Scalar>,
}

pub(super) struct Element<'a> {
    pub name: &'a [u8],
    pub rows: u64,
    pub properties: Vec<Property<'a>>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Encoding {
    Ascii,
    Little,
    Big,
}

pub(super) struct Header<'a> {
    pub encoding: Encoding,
    pub elements: Vec<Element<'a>>,
    /// Where the data begins.
    pub end: usize,
}

/// The lines of the header. They end like the first one does (LF, CR LF or CR), so that a data byte that happens to be
/// a line feed is not taken for the end of a CR line.
struct Lines<'a> {
    bytes: &'a [u8],
    at: usize,
    ending: &'static [u8],
}

impl<'a> Lines<'a> {
    fn new(bytes: &'a [u8]) -> Lines<'a> {
        let start = skip_bom(bytes);
        let first =
            bytes[start..].iter().position(|&b| b == b'\n' || b == b'\r').map_or(&[][..], |i| &bytes[start + i..]);
        let ending: &[u8] = if first.starts_with(b"\r\n") {
            b"\r\n"
        } else if first.starts_with(b"\r") {
            b"\r"
        } else {
            b"\n"
        };
        Lines { bytes, at: start, ending }
    }

    fn next(&mut self) -> Result<Words<'a>> {
        let rest = &self.bytes[self.at..];
        // A linear search for two bytes, which is fine for a header.
        let Some(end) = rest.windows(self.ending.len()).position(|w| w == self.ending) else {
            return format_error("PLY: the file ends within its header (no 'end_header')");
        };
        self.at += end + self.ending.len();
        Ok(Words { bytes: &rest[..end], at: 0 })
    }
}

pub(super) fn header(bytes: &[u8]) -> Result<Header<'_>> {
    let mut lines = Lines::new(bytes);
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    if lines.next()?.next() != Some(b"ply") {
        return format_error("not a PLY file: its first line is not 'ply'");
    }
    loop {
        let mut words = lines.next()?;
        let line = words.bytes;
        let bad = |what: &str| format_error(format!("PLY header: {what} in {}", quote(line)));
        match words.next() {
            Some(b"format") => {
                encoding = match words.next() {
                    Some(b"ascii") => Some(Encoding::Ascii),
                    Some(b"binary_little_endian") => Some(Encoding::Little),
                    Some(b"binary_big_endian") => Some(Encoding::Big),
                    _ => return bad("unknown format"),
                };
            }
            Some(b"element") => {
                let (Some(name), Some(count)) = (words.next(), words.next()) else { return bad("no name or count") };
                let Some(rows) = std::str::from_utf8(count).ok().and_then(|c| c.parse().ok()) else {
                    return bad("the count is no whole number");
                };
                if elements.len() >= MAX_ELEMENTS {
                    return bad("too many elements");
                }
                if elements.iter().any(|e| e.name == name) {
                    return bad("a second element of the same name");
                }
                elements.push(Element { name, rows, properties: Vec::new() });
            }
            Some(b"property") => {
                let Some(element) = elements.last_mut() else { return bad("a property before any element") };
                let first = words.next().unwrap_or_default();
                let list = if first == b"list" { Some(words.next().unwrap_or_default()) } else { None };
                let kind = if list.is_some() { words.next().unwrap_or_default() } else { first };
                let (Some(kind), Some(name)) = (Scalar::named(kind), words.next()) else {
                    return bad("unknown type or no name");
                };
                let list = match list.map(Scalar::named) {
                    None => None,
                    Some(Some(s)) if !matches!(s, Scalar::F32 | Scalar::F64) => Some(s),
                    Some(_) => return bad("the length of a list is no integer type"),
                };
                if element.properties.len() >= MAX_PROPERTIES {
                    return bad("too many properties");
                }
                element.properties.push(Property { name, kind, list });
            }
            Some(b"end_header") => break,
            Some(b"comment" | b"obj_info") | None => (),
            Some(_) => return bad("unknown word"),
        }
    }
    match encoding {
        Some(encoding) => Ok(Header { encoding, elements, end: lines.at }),
        None => format_error("PLY header: no 'format' line"),
    }
}

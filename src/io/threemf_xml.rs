//! The XML parts of a 3MF package: the model with its objects and build, and the relationships that name it.
//!
//! `quick-xml` reads them as a stream of borrowed events, so that memory goes into vertices and triangles only. The
//! core namespace is the one of the root element: names with another prefix belong to extensions and are stepped over,
//! unless the model says that it cannot be understood without them.

use super::text::{line_of, not_a_number, number, quote};
use super::{Sink, Unit, format_error};
use crate::error::{Error, Result, try_push};
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use std::collections::HashMap;
use std::ops::Range;

/// Extensions that do not change the mesh: materials, slices (a second form of it) and named sets of triangles. The
/// production extension (objects in other parts) is read.
const HARMLESS: [&str; 4] = [
    "http://schemas.microsoft.com/3dmanufacturing/production/2015/06",
    "http://schemas.microsoft.com/3dmanufacturing/material/2015/02",
    "http://schemas.microsoft.com/3dmanufacturing/slice/2015/07",
    "http://schemas.microsoft.com/3dmanufacturing/trianglesets/2021/07",
];
/// What memory can run out for.
const OBJECTS: &str = "the objects of a 3MF file";
/// Elements between two looks at the job.
const STRIDE: usize = 1 << 14;

/// One model part. The meshes of its objects are ranges of the pool that [`model`] appends to.
#[derive(Debug, Default)]
pub(super) struct Part {
    pub unit: Unit,
    pub objects: Vec<Object>,
    pub build: Vec<Place>,
}

#[derive(Debug, Default)]
pub(super) struct Object {
    pub id: u32,
    /// False for supports and for what is not meant to be printed.
    pub solid: bool,
    pub vertices: Range<usize>,
    pub triangles: Range<usize>,
    pub components: Vec<Place>,
}

/// An object put somewhere. Small, since a hostile file may have millions.
#[derive(Debug)]
pub(super) struct Place {
    /// The model part that has the object, if it is another one.
    pub part: Option<Box<str>>,
    pub object: u32,
    /// Rows of the 4 x 3 matrix by which row vectors are multiplied, see the 3MF core specification, 3.3.
    pub transform: Option<Box<[f64; 12]>>,
}

/// The part name of the model that the package's relationships name as its start.
pub(super) fn start_part(xml: &[u8]) -> Result<Option<String>> {
    let mut reader = Reader::from_reader(xml);
    loop {
        let event = reader.read_event().map_err(|e| Error::Format(format!("3MF: _rels/.rels: {e}")))?;
        match event {
            Event::Start(e) | Event::Empty(e) if e.local_name().as_ref() == b"Relationship" => {
                let (mut target, mut is_model) = (None, false);
                for a in e.attributes().with_checks(false).flatten() {
                    match a.key.as_ref() {
                        b"Target" => target = Some(unescaped(&a.value)?),
                        b"Type" => is_model = a.value.ends_with(b"/3dmodel"),
                        _ => (),
                    }
                }
                if is_model {
                    return Ok(target);
                }
            }
            Event::Eof => return Ok(None),
            _ => (),
        }
    }
}

/// Parses a model part called `name`; progress goes on from byte `base`.
pub(super) fn model(xml: &[u8], name: &str, base: usize, pool: &mut Sink) -> Result<Part> {
    let mut reader = Reader::from_reader(xml);
    let mut parser = Parser { part: Part::default(), prefix: Vec::new(), rooted: false, object: None, pool };
    let (mut depth, mut elements) = (0usize, 0usize);
    let place = |at: u64| format!("3MF: {name}, line {}", line_of(xml, at as usize));
    loop {
        let event = match reader.read_event() {
            Ok(event) => event,
            Err(e) => return format_error(format!("{}: {e}", place(reader.error_position()))),
        };
        let done = match event {
            Event::Start(e) => {
                depth += 1;
                elements += 1;
                parser.start(&e)
            }
            Event::Empty(e) => {
                elements += 1;
                parser.start(&e).and_then(|()| parser.end(e.name().as_ref()))
            }
            Event::End(e) => {
                depth = depth.saturating_sub(1);
                parser.end(e.name().as_ref())
            }
            Event::Eof => break,
            _ => Ok(()),
        };
        match done {
            Ok(()) => (),
            Err(Error::Format(m)) => return format_error(format!("{}: {m}", place(reader.buffer_position()))),
            Err(other) => return Err(other),
        }
        if elements % STRIDE == 0 {
            parser.pool.at(base + reader.buffer_position() as usize)?;
        }
    }
    if depth > 0 || !parser.rooted {
        return format_error(format!("3MF: {name}: the XML ends early or has no 'model' element"));
    }
    Ok(parser.part)
}

struct Parser<'a, 'b> {
    part: Part,
    /// The prefix of core elements with its colon; empty as a rule.
    prefix: Vec<u8>,
    rooted: bool,
    object: Option<Object>,
    pool: &'a mut Sink<'b>,
}

impl Parser<'_, '_> {
    fn start(&mut self, e: &BytesStart) -> Result<()> {
        let full = e.name();
        let name = match (self.rooted, full.as_ref().strip_prefix(self.prefix.as_slice())) {
            (false, _) => return self.root(e),
            (true, Some(name)) => name,
            (true, None) => full.as_ref(),
        };
        match (name, &self.object) {
            (b"vertex", Some(_)) => self.vertex(e),
            (b"triangle", Some(_)) => self.triangle(e),
            (b"object", None) => self.open(e),
            (b"object", Some(_)) => format_error("an object within an object"),
            (b"component", Some(_)) => {
                let place = place(e)?;
                self.object.as_mut().map_or(Ok(()), |object| try_push(&mut object.components, place, OBJECTS))
            }
            (b"item", None) => try_push(&mut self.part.build, place(e)?, OBJECTS),
            _ => {
                if name.ends_with(b":beamlattice") {
                    self.pool.warn(|| "3MF: a beam lattice is ignored, only triangles are read".into());
                }
                Ok(())
            }
        }
    }

    fn end(&mut self, full: &[u8]) -> Result<()> {
        if full.strip_prefix(self.prefix.as_slice()) != Some(b"object") {
            return Ok(());
        }
        let Some(mut object) = self.object.take() else { return Ok(()) };
        let mesh = &mut self.pool.mesh;
        object.vertices.end = mesh.positions.len();
        object.triangles.end = mesh.triangles.len();
        // Indices count within the object: what it does not have must not reach into the next object's vertices.
        let n = object.vertices.len();
        for v in mesh.triangles[object.triangles.clone()].as_flattened_mut() {
            *v = if (*v as usize) < n { *v } else { u32::MAX };
        }
        try_push(&mut self.part.objects, object, OBJECTS)
    }

    fn root(&mut self, e: &BytesStart) -> Result<()> {
        if e.local_name().as_ref() != b"model" {
            return format_error(format!("the root element is {}, not 'model'", quote(e.name().as_ref())));
        }
        self.prefix = e.name().as_ref()[..e.name().as_ref().len() - b"model".len()].to_vec();
        self.rooted = true;
        self.part.unit = Unit::Millimetre;
        let (mut spaces, mut required) = (HashMap::new(), String::new());
        for a in e.attributes().with_checks(false) {
            let a = a.map_err(|e| Error::Format(e.to_string()))?;
            match a.key.as_ref() {
                b"unit" => self.part.unit = unit(&a.value)?,
                b"requiredextensions" => required = unescaped(&a.value)?,
                key => {
                    if let Some(prefix) = key.strip_prefix(b"xmlns:") {
                        spaces.insert(prefix.to_vec(), unescaped(&a.value)?);
                    }
                }
            }
        }
        for prefix in required.split_ascii_whitespace() {
            let space = spaces.get(prefix.as_bytes()).map_or(prefix, |s| s.as_str());
            if !HARMLESS.contains(&space) {
                let space = quote(space.as_bytes());
                return format_error(format!("the model requires the extension {space}, which is not supported"));
            }
        }
        Ok(())
    }

    fn open(&mut self, e: &BytesStart) -> Result<()> {
        let (v, t) = (self.pool.mesh.positions.len(), self.pool.mesh.triangles.len());
        let mut object = Object { solid: true, vertices: v..v, triangles: t..t, ..Object::default() };
        let mut id = None;
        for a in e.attributes().with_checks(false) {
            let a = a.map_err(|e| Error::Format(e.to_string()))?;
            match a.key.as_ref() {
                b"id" => id = Some(index(&a.value, "id")?),
                b"type" => object.solid = matches!(a.value.as_ref(), b"model" | b"surface"),
                _ => (),
            }
        }
        object.id = id.ok_or_else(|| Error::Format("an object without id".into()))?;
        self.object = Some(object);
        Ok(())
    }

    fn vertex(&mut self, e: &BytesStart) -> Result<()> {
        let (mut p, mut seen) = ([0.0; 3], 0);
        for a in e.attributes().with_checks(false) {
            let a = a.map_err(|e| Error::Format(e.to_string()))?;
            let &[axis @ b'x'..=b'z'] = a.key.as_ref() else { continue };
            let word = a.value.trim_ascii();
            p[(axis - b'x') as usize] = number(word).ok_or_else(|| not_a_number(Some(word), "a coordinate"))?;
            seen |= 1 << (axis - b'x');
        }
        if seen != 0b111 {
            return format_error("a vertex without x, y or z");
        }
        self.pool.vertex(p)
    }

    fn triangle(&mut self, e: &BytesStart) -> Result<()> {
        let (mut t, mut seen) = ([0; 3], 0);
        for a in e.attributes().with_checks(false) {
            let a = a.map_err(|e| Error::Format(e.to_string()))?;
            let &[b'v', corner @ b'1'..=b'3'] = a.key.as_ref() else { continue };
            t[(corner - b'1') as usize] = index(&a.value, "a corner")?;
            seen |= 1 << (corner - b'1');
        }
        if seen != 0b111 {
            return format_error("a triangle without v1, v2 or v3");
        }
        self.pool.triangle(t)
    }
}

/// A component or a build item.
fn place(e: &BytesStart) -> Result<Place> {
    let (mut object, mut place) = (None, Place { part: None, object: 0, transform: None });
    for a in e.attributes().with_checks(false) {
        let a = a.map_err(|e| Error::Format(e.to_string()))?;
        match a.key.as_ref() {
            b"objectid" => object = Some(index(&a.value, "objectid")?),
            b"transform" => {
                let (mut m, mut n) = (Box::new([0.0; 12]), 0);
                for word in a.value.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty()) {
                    let x = number(word).ok_or_else(|| not_a_number(Some(word), "a transform"))?;
                    *m.get_mut(n).ok_or_else(|| Error::Format("a transform has more than 12 numbers".into()))? = x;
                    n += 1;
                }
                if n != 12 {
                    return format_error(format!("a transform has {n} numbers, not 12"));
                }
                place.transform = Some(m);
            }
            key if key.ends_with(b":path") => place.part = Some(unescaped(&a.value)?.into()),
            _ => (),
        }
    }
    place.object = object.ok_or_else(|| Error::Format("a component or item without objectid".into()))?;
    Ok(place)
}

fn index(value: &[u8], what: &str) -> Result<u32> {
    let word = value.trim_ascii();
    match std::str::from_utf8(word).ok().and_then(|w| w.parse().ok()) {
        Some(i) => Ok(i),
        None => format_error(format!("{what} is {}, not a whole number", quote(word))),
    }
}

fn unit(value: &[u8]) -> Result<Unit> {
    Ok(match value.trim_ascii() {
        b"micron" => Unit::Micron,
        b"millimeter" => Unit::Millimetre,
        b"centimeter" => Unit::Centimetre,
        b"inch" => Unit::Inch,
        b"foot" => Unit::Foot,
        b"meter" => Unit::Metre,
        other => return format_error(format!("unknown unit {}", quote(other))),
    })
}

fn unescaped(value: &[u8]) -> Result<String> {
    let bad = || Error::Format(format!("3MF: {} is not readable as text", quote(value)));
    let text = std::str::from_utf8(value).map_err(|_| bad())?;
    Ok(quick_xml::escape::unescape(text).map_err(|_| bad())?.into_owned())
}

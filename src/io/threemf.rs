//! 3MF: a zip package with one or more XML model parts.
//!
//! What is built is what counts: the objects of the build items, with their components, placed by their transforms and
//! in the unit of the file. Objects in other parts (the production extension's `path`) are followed.
//!
//! A package can lie about its size and a tree of components can double at every level, so both are bounded: by
//! [`Limits::expanded_bytes`](super::Limits) and, before anything is placed, by counting what the build expands to.
//! The zip directory is read by `rawzip` (no unsafe code, no allocation by a header's word; encrypted entries and
//! methods other than deflate are refused), decompression is `flate2` on miniz_oxide.

use super::text::quote;
use super::threemf_xml::{Part, Place, model, start_part};
use super::{Sink, format_error};
use crate::error::{Error, Result};
use rawzip::{CompressionMethod, ZipArchive, ZipArchiveEntryWayfinder, ZipSliceArchive};
use std::collections::HashMap;
use std::io::Read;
use std::ops::Range;

/// Deepest nesting of components.
const MAX_DEPTH: u32 = 64;
/// Most objects and components that are visited while placing.
const MAX_PLACED: u64 = 1 << 24;
/// What any package may unpack to, however small it is, and how many times its size beyond.
const FREE_BYTES: u64 = 64 << 20;
const MAX_RATIO: u64 = 200;

pub(super) fn parse(bytes: &[u8], sink: &mut Sink) -> Result<()> {
    let mut package = Package::open(bytes, sink)?;
    let parts = load_parts(&mut package, sink)?;
    let scene = Scene::link(&parts, sink)?;
    scene.place(sink)
}

// --- the package

struct Entry {
    wayfinder: ZipArchiveEntryWayfinder,
    method: CompressionMethod,
    encrypted: bool,
}

struct Package<'a> {
    archive: ZipSliceArchive<&'a [u8]>,
    /// By part name in lower case (part names are case-insensitive) without the leading slash.
    entries: HashMap<String, Entry>,
    /// Bytes that may still be unpacked.
    left: u64,
}

fn key(name: &str) -> String {
    name.trim_start_matches('/').to_ascii_lowercase()
}

impl<'a> Package<'a> {
    fn open(bytes: &'a [u8], sink: &Sink) -> Result<Package<'a>> {
        let bad = |e: rawzip::Error| Error::Format(format!("3MF: not a readable zip archive: {e}"));
        let archive = ZipArchive::from_slice(bytes).map_err(bad)?;
        let mut entries = HashMap::new();
        let mut list = archive.entries();
        while let Some(entry) = list.next_entry().map_err(bad)? {
            let name = key(&String::from_utf8_lossy(entry.file_path().as_bytes()));
            let (method, encrypted) = (entry.compression_method(), entry.flags().is_encrypted());
            entries.insert(name, Entry { wayfinder: entry.wayfinder(), method, encrypted });
        }
        let left = sink.limits.expanded_bytes.min(FREE_BYTES + MAX_RATIO * bytes.len() as u64);
        Ok(Package { archive, entries, left })
    }

    /// Unpacks the part `name`, within what is left, and checks its CRC.
    fn read(&mut self, name: &str, sink: &Sink) -> Result<Vec<u8>> {
        const PIECE: u64 = 1 << 20;
        let shown = quote(name.as_bytes());
        let Some(entry) = self.entries.get(&key(name)) else {
            return format_error(format!("3MF: the package has no part {shown}"));
        };
        let stored = entry.method == CompressionMethod::STORE;
        if entry.encrypted || !(stored || entry.method == CompressionMethod::DEFLATE) {
            return format_error(format!("3MF: {shown} is encrypted or packed by an unknown method"));
        }
        let found = self.archive.get_entry(entry.wayfinder);
        let found = found.map_err(|e| Error::Format(format!("3MF: {shown}: {e}")))?;
        let raw: &mut dyn Read =
            if stored { &mut found.data() } else { &mut flate2::bufread::DeflateDecoder::new(found.data()) };
        let mut reader = found.verifying_reader(raw);
        let mut text = Vec::new();
        loop {
            sink.job.check()?;
            sink.job.afford(sink.held + (text.capacity() as u64).max(PIECE), "unpacking a 3MF file")?;
            text.try_reserve(PIECE as usize).map_err(|_| Error::NoMemory("out of memory: unpacking 3MF".into()))?;
            let got = (&mut reader).take(PIECE).read_to_end(&mut text);
            match got.map_err(|e| Error::Format(format!("3MF: {shown} is damaged: {e}")))? as u64 {
                0 => return Ok(text),
                n if n > self.left => {
                    return format_error(format!("3MF: {shown} unpacks to more than the limit: a zip bomb?"));
                }
                n => self.left -= n,
            }
        }
    }
}

// --- the model parts

/// The start part and every part that is reached from it by a path, each with its name in lower case.
fn load_parts(package: &mut Package, sink: &mut Sink) -> Result<Vec<(String, Part)>> {
    let mut start = None;
    if package.entries.contains_key("_rels/.rels") {
        start = start_part(&package.read("_rels/.rels", sink)?)?;
    }
    let start = start.unwrap_or_else(|| "3D/3dmodel.model".into());
    if !package.entries.contains_key(&key(&start)) {
        return format_error(format!("a zip archive without a 3MF model: it has no part {}", quote(start.as_bytes())));
    }
    let hint = package.entries.iter().filter(|(name, _)| name.ends_with(".model"));
    sink.total = hint.map(|(_, e)| e.wayfinder.uncompressed_size_hint()).fold(1, u64::saturating_add);
    let mut parts: Vec<(String, Part)> = Vec::new();
    let mut queue = vec![key(&start)];
    let mut known: std::collections::HashSet<String> = queue.iter().cloned().collect();
    let mut base = 0usize;
    while let Some(name) = queue.pop() {
        let xml = package.read(&name, sink)?;
        sink.held += xml.len() as u64;
        let part = model(&xml, &name, base, sink)?;
        sink.held -= xml.len() as u64;
        base = base.saturating_add(xml.len());
        if let Some((first, start)) = parts.first().filter(|(_, start)| start.unit != part.unit) {
            let units = format!("{:?} and {:?}", start.unit, part.unit);
            return format_error(format!("3MF: the parts {first} and {name} have different units, {units}"));
        }
        for place in part.objects.iter().flat_map(|o| &o.components).chain(&part.build) {
            if let Some(path) = &place.part {
                let path = key(path);
                if !known.contains(&path) {
                    known.insert(path.clone());
                    queue.push(path);
                }
            }
        }
        parts.push((name, part));
    }
    sink.mesh.unit = parts[0].1.unit;
    Ok(parts)
}

// --- objects and what they expand to

/// An object with its components found.
struct Node<'a> {
    solid: bool,
    vertices: Range<usize>,
    triangles: Range<usize>,
    components: Vec<(usize, &'a Place)>,
}

/// What an object expands to with all its components.
#[derive(Clone, Copy, Default)]
struct Size {
    vertices: u64,
    triangles: u64,
    placed: u64,
    height: u32,
}

impl Size {
    fn add(&mut self, other: Size) {
        self.vertices = self.vertices.saturating_add(other.vertices);
        self.triangles = self.triangles.saturating_add(other.triangles);
        self.placed = self.placed.saturating_add(other.placed);
        self.height = self.height.max(other.height + 1);
    }
}

#[derive(Clone, Copy)]
enum Seen {
    No,
    Open,
    Done(Size),
}

struct Scene<'a> {
    nodes: Vec<Node<'a>>,
    sizes: Vec<Seen>,
    roots: Vec<(usize, &'a Place)>,
}

impl<'a> Scene<'a> {
    /// Finds every referenced object, and the size of everything that is built.
    fn link(parts: &'a [(String, Part)], sink: &mut Sink) -> Result<Scene<'a>> {
        let part_of: HashMap<&str, usize> = parts.iter().enumerate().map(|(i, (name, _))| (name.as_str(), i)).collect();
        let mut ids = HashMap::new();
        for (p, (name, part)) in parts.iter().enumerate() {
            for object in &part.objects {
                let n = ids.len();
                if ids.insert((p, object.id), n).is_some() {
                    return format_error(format!("3MF: {name} has two objects with the id {}", object.id));
                }
            }
        }
        let find = |from: usize, place: &'a Place| {
            let part = place.part.as_deref().map_or(Some(from), |path| part_of.get(key(path).as_str()).copied());
            let node = part.and_then(|p| ids.get(&(p, place.object)));
            node.map(|&n| (n, place)).ok_or_else(|| {
                Error::Format(format!("3MF: {} refers to the object {}, which is missing", parts[from].0, place.object))
            })
        };
        let mut nodes = Vec::with_capacity(ids.len());
        for (p, (_, part)) in parts.iter().enumerate() {
            for o in &part.objects {
                let components = o.components.iter().map(|place| find(p, place)).collect::<Result<Vec<_>>>()?;
                nodes.push(Node {
                    solid: o.solid,
                    vertices: o.vertices.clone(),
                    triangles: o.triangles.clone(),
                    components,
                });
            }
        }
        let roots = parts[0].1.build.iter().map(|place| find(0, place)).collect::<Result<Vec<_>>>()?;
        if roots.is_empty() && !nodes.is_empty() {
            return Err(Error::Empty("3MF: nothing is to be built (the 'build' element has no items)".into()));
        }
        let mut scene = Scene { sizes: vec![Seen::No; nodes.len()], nodes, roots };
        scene.check(sink)?;
        Ok(scene)
    }

    /// Refuses a build that expands beyond the limits.
    fn check(&mut self, sink: &mut Sink) -> Result<()> {
        let mut total = Size::default();
        for i in 0..self.roots.len() {
            let root = self.roots[i].0;
            total.add(self.size(root, 0)?);
        }
        let bytes = total.vertices.saturating_mul(24).saturating_add(total.triangles.saturating_mul(12));
        if bytes > sink.limits.expanded_bytes || total.placed > MAX_PLACED {
            return format_error(format!(
                "3MF: the build expands to {} triangles in {} objects; the limits are {} bytes and {MAX_PLACED} objects",
                total.triangles, total.placed, sink.limits.expanded_bytes
            ));
        }
        let unsolid = |n: usize| matches!(self.sizes[n], Seen::Done(_)) && !self.nodes[n].solid;
        let left_out = (0..self.nodes.len()).filter(|&n| unsolid(n)).count();
        if left_out > 0 {
            sink.warn(|| format!("3MF: {left_out} objects are left out, which are supports or of type 'other'"));
        }
        Ok(())
    }

    /// Counts each object once, however often it is placed: linear in the size of the file.
    fn size(&mut self, n: usize, depth: u32) -> Result<Size> {
        match self.sizes[n] {
            Seen::Done(size) => return Ok(size),
            Seen::Open => return format_error("3MF: an object is a component of itself"),
            Seen::No => self.sizes[n] = Seen::Open,
        }
        let node = &self.nodes[n];
        let mut size = Size { placed: 1, ..Size::default() };
        if node.solid && !node.triangles.is_empty() {
            size.vertices = node.vertices.len() as u64;
            size.triangles = node.triangles.len() as u64;
        }
        let components = if node.solid { node.components.len() } else { 0 };
        for i in 0..components {
            if depth >= MAX_DEPTH {
                return too_deep();
            }
            let child = self.nodes[n].components[i].0;
            size.add(self.size(child, depth + 1)?);
            if size.height > MAX_DEPTH {
                return too_deep();
            }
        }
        // What has no triangles is not visited when placing.
        if size.triangles == 0 {
            size.placed = 0;
        }
        self.sizes[n] = Seen::Done(size);
        Ok(size)
    }

    // --- placing

    /// Replaces the pool of meshes in the sink by what is built from it.
    fn place(&self, sink: &mut Sink) -> Result<()> {
        let pool = std::mem::take(&mut sink.mesh);
        sink.mesh.unit = pool.unit;
        sink.mesh.warnings = pool.warnings;
        sink.held += pool.positions.len() as u64 * 24 + pool.triangles.len() as u64 * 12;
        let pool = (pool.positions, pool.triangles);
        // One object, placed once and as it is: the pool itself is the result.
        if let [(root, place)] = self.roots[..] {
            let node = &self.nodes[root];
            let whole = node.vertices == (0..pool.0.len()) && node.triangles == (0..pool.1.len());
            if whole && node.solid && node.components.is_empty() && place.transform.is_none() {
                (sink.mesh.positions, sink.mesh.triangles) = pool;
                return Ok(());
            }
        }
        let mut total = Size::default();
        for &(root, _) in &self.roots {
            if let Seen::Done(size) = self.sizes[root] {
                total.add(size);
            }
        }
        sink.reserve(total.vertices, total.triangles)?;
        self.roots.iter().try_for_each(|&(root, place)| self.put(root, place.transform.as_deref(), &pool, sink))
    }

    fn put(
        &self,
        n: usize,
        transform: Option<&[f64; 12]>,
        pool: &(Vec<[f64; 3]>, Vec<[u32; 3]>),
        sink: &mut Sink,
    ) -> Result<()> {
        if !matches!(self.sizes[n], Seen::Done(size) if size.triangles > 0) {
            return Ok(());
        }
        sink.job.check()?;
        let node = &self.nodes[n];
        if !node.triangles.is_empty() {
            let offset = sink.mesh.positions.len() as u32;
            let mirrored = transform.is_some_and(|m| determinant(m) < 0.0);
            for &p in &pool.0[node.vertices.clone()] {
                sink.vertex(transform.map_or(p, |m| apply(m, p)))?;
            }
            for &t in &pool.1[node.triangles.clone()] {
                let [a, b, c] = t.map(|v| if v == u32::MAX { v } else { v + offset });
                // A mirror turns the mesh inside out; swapping two corners turns it back.
                sink.triangle(if mirrored { [a, c, b] } else { [a, b, c] })?;
            }
        }
        for (child, place) in &node.components {
            match (place.transform.as_deref(), transform) {
                (Some(own), Some(outer)) => self.put(*child, Some(&compose(own, outer)), pool, sink)?,
                (own, outer) => self.put(*child, own.or(outer), pool, sink)?,
            }
        }
        Ok(())
    }
}

fn too_deep<T>() -> Result<T> {
    format_error(format!("3MF: components are nested more than {MAX_DEPTH} deep"))
}

/// The row vector (p, 1) times the 4 x 3 matrix m.
fn apply(m: &[f64; 12], p: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| p[0] * m[k] + p[1] * m[3 + k] + p[2] * m[6 + k] + m[9 + k])
}

/// First `inner`, then `outer`.
fn compose(inner: &[f64; 12], outer: &[f64; 12]) -> [f64; 12] {
    let mut m = [0.0; 12];
    for row in 0..4 {
        for k in 0..3 {
            let sum = (0..3).map(|j| inner[3 * row + j] * outer[3 * j + k]).sum::<f64>();
            m[3 * row + k] = sum + if row == 3 { outer[9 + k] } else { 0.0 };
        }
    }
    m
}

fn determinant(m: &[f64; 12]) -> f64 {
    m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) + m[2] * (m[3] * m[7] - m[4] * m[6])
}

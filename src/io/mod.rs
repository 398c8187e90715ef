//! Mesh files to raw buffers, and results to coloured PLY. No geometry here.
//!
//! [`load`] turns an STL, OBJ, PLY or 3MF file into a [`RawMesh`]: what the file says, in the file's order, neither
//! welded nor repaired; `mesh::input` judges it. A file is hostile until parsed: what a header claims is held against
//! the bytes that are there before anything is allocated for it, and memory is reserved fallibly.
//!
//! The parsers are our own on top of `rawzip`, `flate2` and `quick-xml`: `ply-rs` panics on a count that overflows and
//! builds a hash map per row, `tobj` splits a file by group and material and so loses its face order, `stl_io` allocates
//! a list of strings per line of text and narrows coordinates to f32.

pub mod colour;
#[cfg(test)]
mod hostile_tests;
mod obj;
mod ply;
mod ply_header;
mod ply_write;
mod stl;
mod text;
mod threemf;
#[cfg(test)]
mod threemf_tests;
mod threemf_xml;

pub use ply_write::{save_ply, write_face_ply, write_ply};

use crate::error::{Error, Result};
use crate::job::Job;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// The length unit of a file. Only 3MF states one; everything else is [`Unit::Unknown`] (by custom millimetres).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u32)]
pub enum Unit {
    /// The file does not say.
    #[default]
    Unknown = 0,
    /// 1e-6 m.
    Micron = 1,
    /// 1e-3 m.
    Millimetre = 2,
    /// 1e-2 m.
    Centimetre = 3,
    /// 0.0254 m.
    Inch = 4,
    /// 0.3048 m.
    Foot = 5,
    /// 1 m.
    Metre = 6,
}

impl Unit {
    /// Its usual short name; none if unknown.
    pub fn name(self) -> Option<&'static str> {
        match self {
            Unit::Unknown => None,
            Unit::Micron => Some("micron"),
            Unit::Millimetre => Some("mm"),
            Unit::Centimetre => Some("cm"),
            Unit::Inch => Some("inch"),
            Unit::Foot => Some("foot"),
            Unit::Metre => Some("m"),
        }
    }
}

impl Unit {
    /// How many millimetres one unit is; `None` for [`Unit::Unknown`].
    pub fn millimetres(self) -> Option<f64> {
        [None, Some(1e-3), Some(1.0), Some(10.0), Some(25.4), Some(304.8), Some(1000.0)][self as usize]
    }
}

/// The contents of a mesh file, as the file has them: not welded, not checked, in file order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RawMesh {
    /// Vertex positions in the file's unit: f32 widened exactly, text parsed to the nearest f64. NaN and infinities are
    /// passed on. STL has three a triangle. 3MF has the vertices of each placed object, transformed.
    pub positions: Vec<[f64; 3]>,
    /// One entry a triangle of the file, in file order, degenerate ones included. A polygon with k corners (OBJ, PLY)
    /// becomes the k - 2 triangles of the fan around its first corner, in place. An index may be out of range, if the
    /// file's is; `u32::MAX` stands for one that the file's own numbering cannot reach.
    pub triangles: Vec<[u32; 3]>,
    /// The unit of the positions, which are not converted.
    pub unit: Unit,
    /// What was odd but readable, in words.
    pub warnings: Vec<String>,
}

impl crate::mesh::MeshSource for RawMesh {
    fn vertex_count(&self) -> usize {
        self.positions.len()
    }
    fn position(&self, i: usize) -> [f64; 3] {
        self.positions[i]
    }
    fn face_count(&self) -> usize {
        self.triangles.len()
    }
    fn triangle(&self, f: usize) -> [i64; 3] {
        self.triangles[f].map(i64::from)
    }
}

/// What a file may cost, besides the memory budget of the [`Job`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Largest file that is read at all, bytes.
    pub file_bytes: u64,
    /// Most bytes that a compressed file (3MF) may unpack to, and most bytes of mesh that its nested components may
    /// expand to. Besides, a file may not unpack to more than 64 MiB plus 200 times its own size.
    pub expanded_bytes: u64,
}

impl Default for Limits {
    fn default() -> Limits {
        Limits { file_bytes: 64 << 30, expanded_bytes: 4 << 30 }
    }
}

/// The units of [`Job::advance`] that one [`load`] reports in total: begin a stage with this number.
pub const LOAD_UNITS: u64 = 1000;
/// The share of [`LOAD_UNITS`] for reading from disk.
const READ_UNITS: u64 = 200;
/// Warnings beyond this number are dropped: a damaged file may have one a line.
const MAX_WARNINGS: usize = 16;

/// Reads the mesh file at `path`. The format is told by the contents, and by the extension only where they do not tell.
///
/// Single-threaded, and reports [`LOAD_UNITS`] of progress to `job`. The file is held in memory as a whole, besides the
/// result (84 bytes a triangle for STL).
///
/// # Errors
/// [`Error::Io`] (no such file, not a regular file, unreadable), [`Error::Format`] (unknown or damaged: the message has
/// the file's name and the line or the figures that contradict each other), [`Error::Empty`] (a valid file without
/// triangles), [`Error::NoMemory`], [`Error::Budget`] (also for a file beyond [`Limits::file_bytes`]),
/// [`Error::Cancelled`].
pub fn load(path: &Path, limits: &Limits, job: &Job) -> Result<RawMesh> {
    let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let named = |e: Error| match e {
        Error::Io(m) => Error::Io(format!("{}: {m}", path.display())),
        Error::Format(m) => Error::Format(format!("{name}: {m}")),
        Error::Empty(m) => Error::Empty(format!("{name}: {m}")),
        other => other,
    };
    let bytes = read_file(path, limits, job).map_err(named)?;
    parse_after(READ_UNITS, &bytes, &extension, limits, job).map_err(named)
}

/// [`load`] for a file that is in memory already; `extension` is in lower case without the dot, or empty.
pub fn parse(bytes: &[u8], extension: &str, limits: &Limits, job: &Job) -> Result<RawMesh> {
    parse_after(0, bytes, extension, limits, job)
}

fn parse_after(reported: u64, bytes: &[u8], extension: &str, limits: &Limits, job: &Job) -> Result<RawMesh> {
    let mut sink = Sink {
        mesh: RawMesh::default(),
        job,
        limits,
        held: bytes.len() as u64,
        total: bytes.len() as u64,
        first: reported,
        reported,
    };
    match detect(bytes, extension)? {
        Format::Stl => stl::parse(bytes, &mut sink)?,
        Format::Obj => obj::parse(bytes, &mut sink)?,
        Format::Ply => ply::parse(bytes, &mut sink)?,
        Format::ThreeMf => threemf::parse(bytes, &mut sink)?,
    }
    sink.finish()
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Stl,
    Obj,
    Ply,
    ThreeMf,
}

/// Tells the format: magic bytes, the size rule of binary STL, the first word of a text, and last the extension.
fn detect(bytes: &[u8], extension: &str) -> Result<Format> {
    if bytes.is_empty() {
        return Err(Error::Format("the file is empty (0 bytes)".into()));
    }
    if bytes.starts_with(b"PK\x03\x04") || bytes.starts_with(b"PK\x05\x06") {
        return Ok(Format::ThreeMf);
    }
    if bytes.starts_with(b"ply\n") || bytes.starts_with(b"ply\r") {
        return Ok(Format::Ply);
    }
    if stl::is_binary(bytes) {
        return Ok(Format::Stl);
    }
    if text::is_text(bytes) {
        match text::first_word(bytes).to_ascii_lowercase().as_slice() {
            b"solid" | b"facet" => return Ok(Format::Stl),
            b"ply" => return Ok(Format::Ply),
            word if obj::KEYWORDS.contains(&word) => return Ok(Format::Obj),
            b"iso-10303-21;" => return Err(Error::Format("a STEP file, not a mesh: export it as STL or 3MF".into())),
            _ => (),
        }
    }
    if bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") {
        return Err(Error::Format("UTF-16 text: save it as plain text (UTF-8)".into()));
    }
    match extension {
        "stl" | "stla" | "stlb" => Ok(Format::Stl),
        "obj" => Ok(Format::Obj),
        "ply" => Ok(Format::Ply),
        "3mf" => Err(Error::Format("not a 3MF file: it does not begin like a zip archive (PK)".into())),
        _ if bytes.starts_with(b"solid") => Ok(Format::Stl),
        _ => Err(Error::Format(format!(
            "not STL, OBJ, PLY or 3MF: it begins with {}",
            text::quote(&bytes[..bytes.len().min(16)])
        ))),
    }
}

/// The whole file, reserved fallibly and read in pieces so that a cancel is heeded.
fn read_file(path: &Path, limits: &Limits, job: &Job) -> Result<Vec<u8>> {
    const PIECE: usize = 8 << 20;
    let io = |e: std::io::Error| Error::Io(e.to_string());
    // Asked before opening: opening a named pipe would wait for its writer.
    if !std::fs::metadata(path).map_err(io)?.is_file() {
        return Err(Error::Io("not a regular file".into()));
    }
    let mut file = File::open(path).map_err(io)?;
    let size = file.metadata().map_err(io)?.len();
    if size > limits.file_bytes {
        let limit = limits.file_bytes;
        return Err(Error::Budget(format!(
            "{}: {size} bytes are more than the limit of {limit} bytes",
            path.display()
        )));
    }
    job.afford(size, "the contents of the file")?;
    let size = usize::try_from(size).map_err(|_| Error::NoMemory(format!("a file of {size} bytes")))?;
    let mut bytes = crate::error::try_vec(size, "the contents of the file")?;
    let mut reported = 0;
    // A file that grows meanwhile is read up to the size it had; one that shrinks is parsed as it is found.
    while bytes.len() < size {
        let piece = PIECE.min(size - bytes.len());
        if (&mut file).take(piece as u64).read_to_end(&mut bytes).map_err(io)? == 0 {
            break;
        }
        let done = (bytes.len() as u128 * READ_UNITS as u128 / size as u128) as u64;
        job.advance(done - reported)?;
        reported = done;
    }
    job.advance(READ_UNITS - reported)?;
    Ok(bytes)
}

/// Where the parsers put what they find: grows fallibly, within the budget and the index range, and reports progress.
struct Sink<'a> {
    mesh: RawMesh,
    job: &'a Job,
    limits: &'a Limits,
    /// Bytes held besides the mesh: the file, and what it unpacked to.
    held: u64,
    /// Bytes to parse, for progress.
    total: u64,
    first: u64,
    reported: u64,
}

impl Sink<'_> {
    #[inline]
    fn vertex(&mut self, p: [f64; 3]) -> Result<()> {
        if self.mesh.positions.len() == self.mesh.positions.capacity() {
            self.reserve(1, 0)?;
        }
        self.mesh.positions.push(p);
        Ok(())
    }

    #[inline]
    fn triangle(&mut self, t: [u32; 3]) -> Result<()> {
        if self.mesh.triangles.len() == self.mesh.triangles.capacity() {
            self.reserve(0, 1)?;
        }
        self.mesh.triangles.push(t);
        Ok(())
    }

    /// Room for more vertices and triangles: exactly these for a known number, at least double for a single one.
    #[cold]
    fn reserve(&mut self, vertices: u64, triangles: u64) -> Result<()> {
        let (p, t) = (&mut self.mesh.positions, &mut self.mesh.triangles);
        let grown = |len: usize, more: u64| if more == 1 { (len as u64 * 2).max(64) } else { len as u64 + more };
        let want = [
            if vertices == 0 { p.capacity() as u64 } else { grown(p.len(), vertices) },
            if triangles == 0 { t.capacity() as u64 } else { grown(t.len(), triangles) },
        ];
        // u32::MAX stands for "no vertex", so it is not an index; a doubling may overshoot what a file can hold.
        let most = u32::MAX as u64;
        if p.len() as u64 + vertices > most || t.len() as u64 + triangles > most {
            return Err(Error::Format(format!("more than {most} vertices or triangles: beyond 32-bit indices")));
        }
        let want = want.map(|w| w.min(most));
        self.job.afford(self.held + want[0] * 24 + want[1] * 12, "loading the mesh")?;
        let oom =
            |_| Error::NoMemory(format!("out of memory: {} vertices and {} triangles of a file", want[0], want[1]));
        p.try_reserve_exact((want[0] as usize).saturating_sub(p.len())).map_err(oom)?;
        t.try_reserve_exact((want[1] as usize).saturating_sub(t.len())).map_err(oom)
    }

    /// Adds a warning; the text is made only if there is room for one, as finding a line number takes a while.
    fn warn(&mut self, message: impl FnOnce() -> String) {
        if self.mesh.warnings.len() < MAX_WARNINGS {
            self.mesh.warnings.push(message());
        }
    }

    /// Reports that the parser is at byte `position`. Call it every few thousand lines.
    fn at(&mut self, position: usize) -> Result<()> {
        let part = position as u128 * (LOAD_UNITS - self.first) as u128 / self.total.max(1) as u128;
        let now = (self.first + part as u64).clamp(self.reported, LOAD_UNITS);
        self.job.advance(now - self.reported)?;
        self.reported = now;
        Ok(())
    }

    fn finish(mut self) -> Result<RawMesh> {
        self.at(self.total as usize)?;
        if self.mesh.triangles.is_empty() {
            return Err(Error::Empty(match self.mesh.positions.len() {
                0 => "no triangles".into(),
                n => format!("no triangles, only {n} vertices: a point cloud?"),
            }));
        }
        Ok(self.mesh)
    }
}

/// Shorthand of the parsers.
fn format_error<T>(message: impl Into<String>) -> Result<T> {
    Err(Error::Format(message.into()))
}

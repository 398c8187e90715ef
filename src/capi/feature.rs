//! Feature: what of a part is too slender or too thin, where, how bad, and why. Needs no ar_compute and no ar_segment and
//! changes none of their results.
//!
//! A feature is a wall, pin, strut, rib, tube, handle, or the body they stand on. Its ratio is D1max / D2max: the longest
//! shortest way on its own surface over its thickness, the wall width where both sides are its own. Features are judged
//! by ar_limits: a ratio at or over a limit counts, and so does a width at or under the least width.

use super::cancel::ar_cancel_token;
use super::compute::Busy;
use super::error::{Fail, ar_error};
use super::guard::{guard, guard_handle};
use super::mesh::{ar_mesh, path_of};
use super::options::{self, CStruct, check_enum, or_default};
use super::progress::{Running, ar_progress_fn};
use super::slices::Out;
use super::status::*;
use crate::feature::kind::Kind;
use crate::feature::limits::{PROCESSES, ProcessLimits, Severity};
use crate::feature::report::ColourBy;
use crate::feature::{self, Feature, FeatureOptions, Features};
use crate::segment::SegmentOptions;
use std::ffi::{c_char, c_void};
use std::mem::offset_of;
use std::sync::{Arc, PoisonError};

/// kind: about as thick as long and wide, or of no simple sort; mostly what the others stand on.
pub const AR_FEATURE_BODY: u32 = 0;
/// kind: long, and about as wide as thick: a pin, strut, hook or wire.
pub const AR_FEATURE_BAR: u32 = 1;
/// kind: long and wide, and thin: a plate, fin, rib, web, tube or shell.
pub const AR_FEATURE_WALL: u32 = 2;
/// kind: a bar that closes on itself.
pub const AR_FEATURE_RING: u32 = 3;

/// severity: under the limits.
pub const AR_SEVERITY_OK: u32 = 0;
/// severity: at or over warn_ratio.
pub const AR_SEVERITY_WARNING: u32 = 1;
/// severity: at or over error_ratio, or at or under min_width.
pub const AR_SEVERITY_ERROR: u32 = 2;

/// ar_feature_info.reasons: for its ratio.
pub const AR_FINDING_SLENDER: u32 = 1;
/// ar_feature_info.reasons: for its width.
pub const AR_FINDING_THIN: u32 = 2;

/// process: powder bed fusion of metals.
pub const AR_PROCESS_METAL_PBF: u32 = 0;
/// process: powder bed fusion of polymers.
pub const AR_PROCESS_POLYMER_PBF: u32 = 1;
/// process: filament extrusion.
pub const AR_PROCESS_FILAMENT: u32 = 2;

/// colour_by: each feature has a colour of its own.
pub const AR_COLOUR_FEATURE: u32 = 0;
/// colour_by: the ratio of the feature, dark violet for the least, yellow for the greatest.
pub const AR_COLOUR_RATIO: u32 = 1;
/// colour_by: the wall width at the face, dark violet for the least, yellow for the greatest.
pub const AR_COLOUR_WIDTH: u32 = 2;

/// How ar_find_features works. All zero but for the size is the default.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ar_feature_options {
    /// sizeof(ar_feature_options), set by ar_feature_options_init.
    pub struct_size: u32,
    /// Threads to work on; 0 = one per core. The results do not depend on it.
    pub threads: u32,
    /// Bytes that the call may use at its peak, about; 0 = no limit. Refused with AR_E_BUDGET before a step allocates.
    pub memory_budget: u64,
    /// Progress function or NULL.
    pub progress: ar_progress_fn,
    /// Passed to `progress`.
    pub user: *mut c_void,
    /// Token that can stop the call, or NULL.
    pub cancel: *const ar_cancel_token,
    /// Pieces smaller than this share of the area are joined with a neighbour, up to 0.5; 0 = 0.001, negative = none.
    pub min_area: f64,
}

// SAFETY: integers, floats and pointers without padding, starts with struct_size; all zero is valid.
unsafe impl CStruct for ar_feature_options {
    const NAME: &'static str = "ar_feature_options";
    const MIN: usize = 48;
}

/// What features are judged by. All zero but for the size is the default.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ar_limits {
    /// sizeof(ar_limits), set by ar_limits_init.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// A feature at or over this ratio deserves a look; 0 = 5.
    pub warn_ratio: f64,
    /// A feature at or over this ratio is too slender; 0 = 8. INFINITY: none is.
    pub error_ratio: f64,
    /// A feature whose least width, in coordinate units, is at or under this is too thin; 0 = widths are not judged.
    pub min_width: f64,
}

// SAFETY: numbers without padding, starts with struct_size; all zero is valid.
unsafe impl CStruct for ar_limits {
    const NAME: &'static str = "ar_limits";
    const MIN: usize = 32;
}

/// A feature. Lengths in coordinate units; NaN where there is no value.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ar_feature_info {
    /// sizeof(ar_feature_info), set by ar_feature_info_init.
    pub struct_size: u32,
    /// Its number, as in ar_get_face_feature.
    pub id: u32,
    /// AR_FEATURE_*.
    pub kind: u32,
    /// AR_SEVERITY_*.
    pub severity: u32,
    /// AR_FINDING_SLENDER, AR_FINDING_THIN, both or 0: what the severity is for.
    pub reasons: u32,
    /// 0.
    pub reserved: u32,
    /// Number of faces.
    pub faces: u64,
    /// d1_max / d2_max: its slenderness.
    pub ratio: f64,
    /// The ratio is not greater, as far as lengths go: d1_upper / d2_max.
    pub ratio_upper: f64,
    /// D1max: the longest shortest way found on its own surface.
    pub d1_max: f64,
    /// No way on its surface is longer.
    pub d1_upper: f64,
    /// D2max: its thickness.
    pub d2_max: f64,
    /// D2min: the least width on its surface.
    pub d2_min: f64,
    /// Area of its surface; of a face that its border crosses, the part on its side.
    pub area: f64,
    /// D1max; of a ring the way around.
    pub length: f64,
    /// The width of a strip of its length that has its area on two sides; of a bar about its thickness.
    pub width: f64,
    /// D2max.
    pub thickness: f64,
    /// x, y, z of the two ends of the way of length d1_max.
    pub d1_ends: [f64; 6],
    /// x, y, z of a point where the width is d2_max.
    pub d2_max_at: [f64; 3],
    /// x, y, z of the two walls there.
    pub d2_max_contacts: [f64; 6],
    /// x, y, z of a point where the width is d2_min.
    pub d2_min_at: [f64; 3],
    /// x, y, z of the two walls there.
    pub d2_min_contacts: [f64; 6],
    /// x, y, z of the centroid of its surface.
    pub centroid: [f64; 3],
    /// x, y, z of the centre of the box that it fits in.
    pub box_center: [f64; 3],
    /// x, y, z of the unit directions of the edges of that box, right-handed.
    pub box_axes: [f64; 9],
    /// Lengths of those edges, falling.
    pub box_size: [f64; 3],
}

// SAFETY: numbers without padding, starts with struct_size.
unsafe impl CStruct for ar_feature_info {
    const NAME: &'static str = "ar_feature_info";
    const MIN: usize = 448;
}

#[cfg(target_pointer_width = "64")]
const _: () = {
    assert!(size_of::<ar_feature_options>() == 48 && offset_of!(ar_feature_options, min_area) == 40);
    assert!(size_of::<ar_limits>() == 32 && offset_of!(ar_limits, min_width) == 24);
    assert!(size_of::<ar_feature_info>() == 448 && offset_of!(ar_feature_info, ratio) == 32);
    assert!(offset_of!(ar_feature_info, d1_ends) == 112 && offset_of!(ar_feature_info, box_size) == 424);
};

/// Use ar_feature_options_init. Sets the first `struct_size` bytes of `options` to the defaults.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_feature_options_init_sized(
    options: *mut ar_feature_options,
    struct_size: u32,
) -> ar_status {
    // SAFETY: the caller vouches for `struct_size` writable bytes.
    unsafe { options::init(options, struct_size) }
}

/// Use ar_limits_init. Sets the first `struct_size` bytes of `limits` to the defaults.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_limits_init_sized(limits: *mut ar_limits, struct_size: u32) -> ar_status {
    // SAFETY: the caller vouches for `struct_size` writable bytes.
    unsafe { options::init(limits, struct_size) }
}

/// Use ar_feature_info_init. Sets the first `struct_size` bytes of `info` to zero and the size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_feature_info_init_sized(info: *mut ar_feature_info, struct_size: u32) -> ar_status {
    // SAFETY: the caller vouches for `struct_size` writable bytes.
    unsafe { options::init(info, struct_size) }
}

/// Limits for a process, to start from: widths in millimetres. docs/findings.md says where they come from.
///   process   AR_PROCESS_*.
///   out       prepared by ar_limits_init.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_limits_of_process(process: u32, out: *mut ar_limits, error: *mut ar_error) -> ar_status {
    // SAFETY: the pointers are as the header demands.
    unsafe {
        guard(error, || {
            options::check_out(out)?;
            let known = [AR_PROCESS_METAL_PBF, AR_PROCESS_POLYMER_PBF, AR_PROCESS_FILAMENT];
            let l = PROCESSES[check_enum(process, &known, "process")? as usize].limits;
            let (warn_ratio, error_ratio, min_width) = (l.warn_ratio, l.error_ratio, l.min_width);
            options::write(out, ar_limits { struct_size: 0, reserved: 0, warn_ratio, error_ratio, min_width });
            Ok(())
        })
    }
}

/// Finds and measures the features of the part, for the getters below.
///   mesh      exclusive for the length of the call.
///   options   NULL = defaults.
/// Features cover all faces that take part and are numbered from 0 by falling area. On success they replace those of an
/// earlier call; on failure or cancel those stay. O(faces log faces) in time and about 1 kB a face.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_find_features(
    mesh: *mut ar_mesh,
    options: *const ar_feature_options,
    error: *mut ar_error,
) -> ar_status {
    // SAFETY: the pointers are as the header demands.
    unsafe {
        guard_handle(mesh, error, |m| {
            let o = options::read_or_default(options)?;
            let how = feature_options(&o)?;
            let (threads, memory_budget) = (o.threads, o.memory_budget);
            let running = Running { threads, memory_budget, progress: o.progress, user: o.user, cancel: o.cancel };
            let _busy = Busy::enter(&m.busy)?;
            let found = running.run(|job| feature::find_features(&m.mesh, &how, job))?;
            *m.features.write().unwrap_or_else(PoisonError::into_inner) = Some(Arc::new(found));
            Ok(())
        })
    }
}

/// Feature of every face in the order of the file or buffer, -1 for a face that takes no part. A face that a border
/// crosses has the feature that most of it belongs to; features are measured on what is theirs of such faces.
///   out   capacity numbers, capacity in faces.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_get_face_feature(
    mesh: *const ar_mesh,
    out: *mut i32,
    capacity: usize,
    count: *mut usize,
    error: *mut ar_error,
) -> ar_status {
    // SAFETY: the pointers are as the header demands.
    unsafe {
        guard_handle(mesh, error, |m| {
            let found = features(m)?;
            let ids: Vec<i32> = found.face_feature_of_input(&m.mesh).collect();
            Out { buffer: out, capacity, count }.fill(ids.len(), |f| [ids[f]])
        })
    }
}

/// The features by number, judged.
///   limits   NULL = defaults.
///   out      capacity structs, capacity in features. The first must be prepared by ar_feature_info_init: its
///            struct_size is taken as the size of all, and set in all.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_get_features(
    mesh: *const ar_mesh,
    limits: *const ar_limits,
    out: *mut ar_feature_info,
    capacity: usize,
    count: *mut usize,
    error: *mut ar_error,
) -> ar_status {
    // SAFETY: the pointers are as the header demands.
    unsafe {
        guard_handle(mesh, error, |m| {
            let limits = process_limits(&options::read_or_default(limits)?)?;
            let found = features(m)?;
            let n = found.features.len();
            Out { buffer: out, capacity, count }.check(n)?;
            if out.is_null() || n == 0 {
                return Ok(());
            }
            options::check_out(out)?;
            if !count.is_null() {
                count.write_unaligned(n);
            }
            let size = out.cast::<u32>().read_unaligned();
            for (k, f) in found.features.iter().enumerate() {
                let place = out.cast::<u8>().add(k * size as usize).cast::<ar_feature_info>();
                place.cast::<u32>().write_unaligned(size);
                options::write(place, info(k, f, &limits));
            }
            Ok(())
        })
    }
}

/// The features as JSON, a NUL-terminated text: docs/report-schema.json describes it. Worst first.
///   limits   NULL = defaults.
///   text     capacity characters, the NUL among them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_get_report(
    mesh: *const ar_mesh,
    limits: *const ar_limits,
    text: *mut c_char,
    capacity: usize,
    count: *mut usize,
    error: *mut ar_error,
) -> ar_status {
    // SAFETY: the pointers are as the header demands.
    unsafe {
        guard_handle(mesh, error, |m| {
            let limits = process_limits(&options::read_or_default(limits)?)?;
            let report = features(m)?.to_json(&m.mesh, &limits, m.unit.name());
            let bytes = report.as_bytes();
            Out { buffer: text, capacity, count }
                .fill(bytes.len() + 1, |i| [bytes.get(i).copied().unwrap_or(0) as c_char])
        })
    }
}

/// Writes the welded vertices and used faces as binary PLY, with a colour and the scalars feature and ratio (float; by
/// width, width too) for every face. Needs ar_find_features.
///   path        NUL-terminated; an existing file is replaced.
///   colour_by   AR_COLOUR_*.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_features_write_ply(
    mesh: *const ar_mesh,
    path: *const c_char,
    colour_by: u32,
    error: *mut ar_error,
) -> ar_status {
    // SAFETY: the pointers are as the header demands.
    unsafe {
        guard_handle(mesh, error, |m| {
            let known = [AR_COLOUR_FEATURE, AR_COLOUR_RATIO, AR_COLOUR_WIDTH];
            let by = match check_enum(colour_by, &known, "colour_by")? {
                AR_COLOUR_RATIO => ColourBy::Ratio,
                AR_COLOUR_WIDTH => ColourBy::Width,
                _ => ColourBy::Feature,
            };
            let (path, found) = (path_of(path)?, features(m)?);
            let running = Running {
                threads: 0,
                memory_budget: 0,
                progress: None,
                user: std::ptr::null_mut(),
                cancel: std::ptr::null(),
            };
            running.run(|job| found.save_ply(&m.mesh, &path, by, job))
        })
    }
}

fn features(m: &ar_mesh) -> Result<Arc<Features>, Fail> {
    let held = m.features.read().unwrap_or_else(PoisonError::into_inner).clone();
    held.ok_or_else(|| Fail::new(AR_E_NOT_COMPUTED, "no features yet: call ar_find_features first"))
}

fn feature_options(o: &ar_feature_options) -> Result<FeatureOptions, Fail> {
    let defaults = SegmentOptions::default();
    let min_area =
        if o.min_area < 0.0 { 0.0 } else { or_default(o.min_area, defaults.min_area, [0.0, 0.5], "min_area")? };
    Ok(FeatureOptions { segments: SegmentOptions { min_area, ..defaults } })
}

fn process_limits(l: &ar_limits) -> Result<ProcessLimits, Fail> {
    let defaults = ProcessLimits::default();
    if l.reserved != 0 {
        return Err(Fail::argument("reserved is not 0"));
    }
    let any = [0.0, f64::INFINITY];
    Ok(ProcessLimits {
        warn_ratio: or_default(l.warn_ratio, defaults.warn_ratio, any, "warn_ratio")?,
        error_ratio: or_default(l.error_ratio, defaults.error_ratio, any, "error_ratio")?,
        min_width: or_default(l.min_width, 0.0, [0.0, f64::MAX], "min_width")?,
    })
}

fn info(id: usize, f: &Feature, limits: &ProcessLimits) -> ar_feature_info {
    let verdict = limits.judge(f);
    let pair = |[[a, b, c], [d, e, g]]: [[f64; 3]; 2]| [a, b, c, d, e, g];
    let [[a, b, c], [d, e, g], [h, i, j]] = f.bounds.axes;
    ar_feature_info {
        struct_size: 0,
        id: id as u32,
        kind: match f.kind {
            Kind::Body => AR_FEATURE_BODY,
            Kind::Bar => AR_FEATURE_BAR,
            Kind::Wall => AR_FEATURE_WALL,
            Kind::Ring => AR_FEATURE_RING,
        },
        severity: match verdict.severity {
            Severity::Fine => AR_SEVERITY_OK,
            Severity::Warning => AR_SEVERITY_WARNING,
            Severity::Error => AR_SEVERITY_ERROR,
        },
        reasons: if verdict.slender { AR_FINDING_SLENDER } else { 0 } | if verdict.thin { AR_FINDING_THIN } else { 0 },
        reserved: 0,
        faces: f.faces.into(),
        ratio: f.ratio,
        ratio_upper: f.ratio_range[1],
        d1_max: f.d1_max,
        d1_upper: f.d1_upper,
        d2_max: f.d2_max.width,
        d2_min: f.d2_min.width,
        area: f.area,
        length: f.dimensions[0],
        width: f.dimensions[1],
        thickness: f.dimensions[2],
        d1_ends: pair(f.d1_ends),
        d2_max_at: f.d2_max.at,
        d2_max_contacts: pair(f.d2_max.contacts),
        d2_min_at: f.d2_min.at,
        d2_min_contacts: pair(f.d2_min.contacts),
        centroid: f.centroid,
        box_center: f.bounds.centre,
        box_axes: [a, b, c, d, e, g, h, i, j],
        box_size: f.bounds.size,
    }
}

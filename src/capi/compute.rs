//! Compute: fills D1, D2 and their ratio.

use super::cancel::ar_cancel_token;
use super::error::{Fail, ar_error};
use super::guard::guard_handle;
use super::mesh::ar_mesh;
use super::options::{self, CStruct, check_enum, or_default};
use super::progress::{Running, ar_progress_fn};
use super::status::*;
use crate::field::{self, D2Method, Profile};
use crate::geodesic::Mode;
use crate::thickness::{cone, sdf};
use std::ffi::c_void;
use std::mem::offset_of;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, PoisonError};

/// profile: for parts that are to be printed, on any triangulation. D1 by exact geodesic distances (on a simplified mesh
/// where those on the part are dear) towards the corners of the shape, D2 the wall width. The default.
pub const AR_PROFILE_PRINT: u32 = 0;
/// profile: the method as the paper has it, Eqs. 1-13 on the mesh as given. For meshes of good triangles, and for
/// comparing with the paper.
pub const AR_PROFILE_PAPER: u32 = 1;

/// d1_method: distances from as many vertices as it takes to know D1 of every vertex to within d1_tolerance, by the
/// triangle inequality; the number does not grow with the mesh. The default.
pub const AR_D1_CERTIFIED: u32 = 0;
/// d1_method: distances from every vertex (the paper's definition, the reference).
pub const AR_D1_ALL_VERTICES: u32 = 1;

/// d2_method: that of the profile: AR_D2_WALL with AR_PROFILE_PRINT, AR_D2_INSCRIBED with AR_PROFILE_PAPER. The default.
pub const AR_D2_PROFILE: u32 = 0;
/// d2_method: diameter of an inscribed sphere, the least of l / cos(theta) over the rays (Eqs. 10-13).
pub const AR_D2_INSCRIBED: u32 = 3;
/// d2_method: wall width, the diameter of the inscribed sphere that is held from opposite sides, 115 degrees apart or
/// more seen from its centre: a contact around a convex edge does not count, so the width does not fall to 0 there.
/// Overlapping shells count as one solid. Takes no rays.
pub const AR_D2_WALL: u32 = 2;
/// d2_method: shape diameter function as Shapira 2008 and CGAL define it: mean of the ray lengths within one median
/// absolute deviation of their median, obtuse hits rejected, raw values (not smoothed or normalised).
pub const AR_D2_SDF: u32 = 1;

/// How ar_compute and ar_geodesic_distance work. All zero but for the size is the default.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ar_compute_options {
    /// sizeof(ar_compute_options), set by ar_compute_options_init.
    pub struct_size: u32,
    /// Threads to work on; 0 = one per core. The results do not depend on it.
    pub threads: u32,
    /// Bytes that the call may use at its peak, about; 0 = no limit. Refused with AR_E_BUDGET before a step
    /// allocates.
    pub memory_budget: u64,
    /// Progress function or NULL.
    pub progress: ar_progress_fn,
    /// Passed to `progress`.
    pub user: *mut c_void,
    /// Token that can stop the call, or NULL.
    pub cancel: *const ar_cancel_token,
    /// AR_PROFILE_*.
    pub profile: u32,
    /// D2: rays a face, 1 to 4096; 0 = 20, with AR_D2_SDF 25.
    pub rays: u32,
    /// D2: full opening angle of the cone of rays, radians, above 0.001 and below pi - 0.001; 0 = 2 pi / 3 (120 degrees).
    pub cone_angle: f64,
    /// D2: AR_D2_*.
    pub d2_method: u32,
    /// D1: AR_D1_*.
    pub d1_method: u32,
    /// D1: m in the time step t = m * h^2 of the heat method, h the mean edge length; 1e-3 to 1e6; 0 = 1.
    pub time_factor: f64,
    /// D1: with AR_D1_CERTIFIED the relative gap between the bounds at which a vertex counts as known, 1e-6 to 1;
    /// 0 = 0.05, with AR_PROFILE_PAPER 0.02. Most values are far closer than the gap.
    pub d1_tolerance: f64,
}

// SAFETY: integers, floats and pointers without padding, starts with struct_size; all zero is valid.
unsafe impl CStruct for ar_compute_options {
    const NAME: &'static str = "ar_compute_options";
    const MIN: usize = 80;
}

#[cfg(target_pointer_width = "64")]
const _: () = {
    assert!(size_of::<ar_compute_options>() == 80 && offset_of!(ar_compute_options, profile) == 40);
    assert!(offset_of!(ar_compute_options, cone_angle) == 48 && offset_of!(ar_compute_options, d1_tolerance) == 72);
};

/// Use ar_compute_options_init. Sets the first `struct_size` bytes of `options` to the defaults.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_compute_options_init_sized(
    options: *mut ar_compute_options,
    struct_size: u32,
) -> ar_status {
    // SAFETY: the caller vouches for `struct_size` writable bytes.
    unsafe { options::init(options, struct_size) }
}

/// Computes D1, D2 and ratio of every vertex, for the getters of the section "Results".
///   mesh      exclusive for the length of the call.
///   options   NULL = defaults.
/// On success the results replace those of an earlier call; on failure or cancel those stay.
///   Time      D2 takes about O(faces log faces), times rays where it shoots any. D1 takes one distance field a source:
///             some dozen to some hundred sources with AR_D1_CERTIFIED, in the worst case (and with
///             AR_D1_ALL_VERTICES) one per vertex. A heat distance takes about O(vertices log vertices); an exact one,
///             in the print profile, 2 to 10 ms.
///   Memory    about 1.6 kB a vertex.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_compute(
    mesh: *mut ar_mesh,
    options: *const ar_compute_options,
    error: *mut ar_error,
) -> ar_status {
    // SAFETY: the pointers are as the header demands.
    unsafe {
        guard_handle(mesh, error, |m| {
            let options = options::read_or_default(options)?;
            let (how, running) = (field_options(&options)?, running(&options));
            let _busy = Busy::enter(&m.busy)?;
            let field = running.run(|job| field::compute(&m.mesh, &how, job))?;
            *m.field.write().unwrap_or_else(PoisonError::into_inner) = Some(Arc::new(field));
            Ok(())
        })
    }
}

/// The part of the options that says what to compute.
pub(super) fn field_options(o: &ar_compute_options) -> Result<field::Options, Fail> {
    let profile = match check_enum(o.profile, &[AR_PROFILE_PRINT, AR_PROFILE_PAPER], "profile")? {
        AR_PROFILE_PAPER => Profile::Paper,
        _ => Profile::Print,
    };
    // Heat distances are cheap by the source, and the paper has them from every vertex.
    let usual = if profile == Profile::Paper { 0.02 } else { 0.05 };
    let d1 = match check_enum(o.d1_method, &[AR_D1_CERTIFIED, AR_D1_ALL_VERTICES], "d1_method")? {
        AR_D1_CERTIFIED => {
            Mode::Certified { tolerance: or_default(o.d1_tolerance, usual, [1e-6, 1.0], "d1_tolerance")? }
        }
        _ if o.d1_tolerance != 0.0 => {
            return Err(Fail::argument("d1_tolerance is set but d1_method is not AR_D1_CERTIFIED"));
        }
        _ => Mode::AllSources,
    };
    let methods = [AR_D2_PROFILE, AR_D2_SDF, AR_D2_WALL, AR_D2_INSCRIBED];
    let (d2, usual) = match check_enum(o.d2_method, &methods, "d2_method")? {
        AR_D2_SDF => (D2Method::ShapeDiameter, sdf::SDF_RAYS),
        AR_D2_WALL => (D2Method::Wall, cone::RAYS),
        AR_D2_INSCRIBED => (D2Method::Inscribed, cone::RAYS),
        _ => (D2Method::Profile, cone::RAYS),
    };
    let rays = match o.rays {
        0 => usual,
        n @ 1..=4096 => n as usize,
        n => return Err(Fail::argument(format!("rays is {n}, outside 1..4096"))),
    };
    let cone_angle = or_default(o.cone_angle, cone::ANGLE, [1e-3, std::f64::consts::PI - 1e-3], "cone_angle")?;
    let time_factor = or_default(o.time_factor, 1.0, [1e-3, 1e6], "time_factor")?;
    Ok(field::Options { profile, d1, time_factor, d2, rays, cone_angle })
}

/// The part of the options that says how the call may run.
pub(super) fn running(o: &ar_compute_options) -> Running {
    let (threads, memory_budget) = (o.threads, o.memory_budget);
    Running { threads, memory_budget, progress: o.progress, user: o.user, cancel: o.cancel }
}

/// Held while a call needs a handle for itself.
pub(super) struct Busy<'a>(&'a AtomicBool);

impl Busy<'_> {
    pub fn enter(flag: &AtomicBool) -> Result<Busy<'_>, Fail> {
        if flag.swap(true, Ordering::AcqRel) {
            return Err(Fail::new(AR_E_BUSY, "the mesh is in use by another call that needs it exclusively"));
        }
        Ok(Busy(flag))
    }
}

impl Drop for Busy<'_> {
    fn drop(&mut self) {
        self.0.store(false, Ordering::Release);
    }
}

//! Progress. Stages run in the order of their numbers; a call may skip some.

use super::cancel::{self, ar_cancel_token};
use super::error::Fail;
use crate::job::{CancelToken, Job, Stage};
use std::ffi::{c_char, c_void};

/// Reading and checking the mesh.
pub const AR_STAGE_MESH: u32 = 0;
/// Refining the analysis surface.
pub const AR_STAGE_SURFACE: u32 = 1;
/// D2: shooting rays.
pub const AR_STAGE_THICKNESS: u32 = 2;
/// D1: factoring the Laplacian of the heat method.
pub const AR_STAGE_FACTOR: u32 = 3;
/// D1: solving for geodesic distances.
pub const AR_STAGE_GEODESIC: u32 = 4;
/// Partition into features.
pub const AR_STAGE_SEGMENT: u32 = 5;

/// Called some 30 times a second with the fraction done (0 to 1, never falling, 1 at the end) and the AR_STAGE_*.
/// Return 0 to go on, anything else to cancel. Called only on the thread that made the call; `user` is passed
/// through. It must return: no exception and no longjmp may leave it (armesh.hpp carries exceptions across).
pub type ar_progress_fn = Option<unsafe extern "C" fn(user: *mut c_void, fraction: f64, stage: u32) -> i32>;

/// Name of a stage, such as "thickness", to show beside a progress bar; "unknown" for other numbers. Never NULL,
/// static.
#[unsafe(no_mangle)]
pub extern "C" fn ar_stage_name(stage: u32) -> *const c_char {
    const NAMES: [&str; 6] = ["mesh\0", "surface\0", "thickness\0", "factor\0", "geodesic\0", "segment\0"];
    NAMES.get(stage as usize).unwrap_or(&"unknown\0").as_ptr().cast()
}

/// More threads than this are refused: it must be a mistake.
pub(super) const MAX_THREADS: u32 = 4096;

/// The fields by which several option structs say how a call may run.
pub(super) struct Running {
    pub threads: u32,
    pub memory_budget: u64,
    pub progress: ar_progress_fn,
    pub user: *mut c_void,
    pub cancel: *const ar_cancel_token,
}

impl Running {
    /// Runs `work` with these limits.
    pub unsafe fn run<T: Send>(&self, work: impl FnOnce(&Job) -> crate::error::Result<T> + Send) -> Result<T, Fail> {
        if self.threads > MAX_THREADS {
            return Err(Fail::argument(format!("threads is {}, more than {MAX_THREADS}", self.threads)));
        }
        // SAFETY: the caller vouches that `cancel` is NULL or a live token.
        let token = if self.cancel.is_null() { CancelToken::default() } else { unsafe { cancel::token(self.cancel)? } };
        let budget = (self.memory_budget > 0).then_some(self.memory_budget);
        let job = Job::new(self.threads as usize, budget, token);
        // SAFETY: the caller vouches for the function and for `user`.
        let mut call = |fraction: f64, stage: Stage| match self.progress {
            Some(f) => unsafe { f(self.user, fraction, stage as u32) == 0 },
            None => true,
        };
        Ok(job.run(self.progress.is_some().then_some(&mut call as _), || work(&job))?)
    }
}

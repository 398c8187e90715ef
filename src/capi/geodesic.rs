//! Geodesic distance from one vertex.

use super::compute::{ar_compute_options, field_options, running};
use super::error::{Fail, ar_error};
use super::guard::guard_handle;
use super::mesh::ar_mesh;
use super::options;
use super::slices::Out;
use super::status::ar_status;
use crate::field;

/// Geodesic distance from one vertex to every vertex, by the heat method (Eqs. 1-9). Needs no ar_compute and
/// changes no results.
///   source    a vertex that takes part in the computation.
///   options   NULL = defaults; the D2 fields do not matter.
///   out       capacity numbers, capacity in vertices: coordinate units; 0 at the source; NaN in other components
///             and where a vertex takes no part.
/// With out == NULL only *count is written and nothing is computed. Each call factors the operator anew: for D1 of
/// every vertex ar_compute is far faster.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_geodesic_distance(
    mesh: *const ar_mesh,
    source: u32,
    options: *const ar_compute_options,
    out: *mut f64,
    capacity: usize,
    count: *mut usize,
    error: *mut ar_error,
) -> ar_status {
    // SAFETY: the pointers are as the header demands.
    unsafe {
        guard_handle(mesh, error, |m| {
            let options = options::read_or_default(options)?;
            let (how, n) = (field_options(&options)?, m.vertex_count());
            let out = Out { buffer: out, capacity, count };
            out.check(n)?;
            if out.buffer.is_null() {
                return Ok(());
            }
            let start = if (source as usize) < n { m.welded(source as usize) } else { None };
            let missing = || Fail::argument(format!("vertex {source} of {n} does not exist or takes no part"));
            let start = start.ok_or_else(missing)?;
            let distance = running(&options).run(|job| field::distance(&m.mesh, start as u32, &how, job))?;
            out.fill(n, |i| [m.welded(i).map_or(f64::NAN, |w| distance[w])])
        })
    }
}

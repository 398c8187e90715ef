//! Coloured PLY, to look at in MeshLab, ParaView and the like.

use super::error::ar_error;
use super::guard::guard_handle;
use super::mesh::{ar_mesh, path_of};
use super::results::{field, quantity};
use super::status::ar_status;
use std::ffi::c_char;

/// Writes the welded vertices and used faces with the results as binary PLY: vertex x, y, z (float, or double where
/// floats would show), red, green, blue (uchar, by `quantity` on the viridis scale: dark violet for the least value,
/// yellow for the greatest; grey where it is NaN), d1, d2, ratio, quality (float; quality is `quantity` once more, under
/// the only name that MeshLab reads). Needs ar_compute.
///   path       NUL-terminated; an existing file is replaced.
///   quantity   AR_D1, AR_D2 or AR_RATIO.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_mesh_write_ply(
    mesh: *const ar_mesh,
    path: *const c_char,
    quantity: u32,
    error: *mut ar_error,
) -> ar_status {
    // SAFETY: the pointers are as the header demands.
    unsafe {
        guard_handle(mesh, error, |m| {
            let (path, quantity) = (path_of(path)?, self::quantity(quantity)?);
            field(m)?.save_ply(&m.mesh, &path, quantity)?;
            Ok(())
        })
    }
}

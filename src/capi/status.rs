//! Status codes. Values are fixed and never reused.

use std::ffi::c_char;

/// AR_OK or one of AR_E_*.
pub type ar_status = i32;

/// Success.
pub const AR_OK: ar_status = 0;
/// A pointer that must not be NULL is.
pub const AR_E_NULL: ar_status = -1;
/// A parameter or option is outside its documented range.
pub const AR_E_ARGUMENT: ar_status = -2;
/// struct_size is no size of any version of the struct, or a part unknown to this library is not zero.
pub const AR_E_STRUCT: ar_status = -3;
/// The buffer is too small; *count says what is needed.
pub const AR_E_CAPACITY: ar_status = -4;
/// The mesh has no vertices or no faces.
pub const AR_E_EMPTY: ar_status = -5;
/// A face names a vertex that does not exist. ar_error.first_index is the first such face.
pub const AR_E_INDEX: ar_status = -6;
/// A coordinate is NaN or infinite. ar_error.first_index is the first such vertex.
pub const AR_E_NON_FINITE: ar_status = -7;
/// No face has an area: there is nothing to measure.
pub const AR_E_DEGENERATE: ar_status = -8;
/// A file cannot be read or written.
pub const AR_E_IO: ar_status = -9;
/// A file is not what its name or header says, or is damaged.
pub const AR_E_FORMAT: ar_status = -10;
/// An allocation failed, or the worker threads could not be started.
pub const AR_E_NO_MEMORY: ar_status = -11;
/// The memory budget does not allow the next step; nothing was allocated for it.
pub const AR_E_BUDGET: ar_status = -12;
/// The progress function or the cancel token asked to stop.
pub const AR_E_CANCELLED: ar_status = -13;
/// ar_compute has not succeeded on this mesh yet.
pub const AR_E_NOT_COMPUTED: ar_status = -14;
/// A numerical method failed (a factorisation broke down).
pub const AR_E_NUMERIC: ar_status = -15;
/// A defect of this library. Please report it.
pub const AR_E_INTERNAL: ar_status = -16;
/// The handle was in use during an earlier AR_E_INTERNAL and can only be freed.
pub const AR_E_POISONED: ar_status = -17;
/// The pointer is not a live handle of this type (freed already?). Best effort.
pub const AR_E_HANDLE: ar_status = -18;
/// The handle is in use by a running call that needs it exclusively. Best effort.
pub const AR_E_BUSY: ar_status = -19;

/// Name of a code, such as "AR_E_NULL"; "AR_E_UNKNOWN" for a number that is none. Never NULL, static.
#[unsafe(no_mangle)]
pub extern "C" fn ar_status_name(status: ar_status) -> *const c_char {
    const NAMES: [&str; 20] = [
        "AR_OK\0",
        "AR_E_NULL\0",
        "AR_E_ARGUMENT\0",
        "AR_E_STRUCT\0",
        "AR_E_CAPACITY\0",
        "AR_E_EMPTY\0",
        "AR_E_INDEX\0",
        "AR_E_NON_FINITE\0",
        "AR_E_DEGENERATE\0",
        "AR_E_IO\0",
        "AR_E_FORMAT\0",
        "AR_E_NO_MEMORY\0",
        "AR_E_BUDGET\0",
        "AR_E_CANCELLED\0",
        "AR_E_NOT_COMPUTED\0",
        "AR_E_NUMERIC\0",
        "AR_E_INTERNAL\0",
        "AR_E_POISONED\0",
        "AR_E_HANDLE\0",
        "AR_E_BUSY\0",
    ];
    let name = usize::try_from(-i64::from(status)).ok().and_then(|i| NAMES.get(i));
    name.unwrap_or(&"AR_E_UNKNOWN\0").as_ptr().cast()
}

//! Error details.

use super::options::{self, CStruct};
use super::status::*;
use crate::error::Error;
use std::ffi::c_char;
use std::mem::offset_of;

/// Size of ar_error.message in bytes, the terminating NUL included.
pub const AR_MESSAGE_SIZE: usize = 512;
/// "No index", "none" wherever an index is a uint64_t.
pub const AR_NONE: u64 = u64::MAX;

/// What went wrong. The caller owns it; one may serve many calls, but not two at once.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ar_error {
    /// sizeof(ar_error), set by ar_error_init.
    pub struct_size: u32,
    /// The code that the call returned.
    pub status: ar_status,
    /// Index of the first offending face or vertex (the message says which), or AR_NONE.
    pub first_index: u64,
    /// Number of offending faces or vertices; 0 if the failure is not about any.
    pub count: u64,
    /// UTF-8, NUL-terminated, one line: what and where. Truncated between characters if too long.
    pub message: [c_char; AR_MESSAGE_SIZE],
}

// SAFETY: integers only, starts with struct_size.
unsafe impl CStruct for ar_error {
    const NAME: &'static str = "ar_error";
    const MIN: usize = 536;
}

const _: () = assert!(size_of::<ar_error>() == 536 && offset_of!(ar_error, message) == 24);

/// Use ar_error_init. Prepares the first `struct_size` bytes of `error`: status AR_OK, first_index AR_NONE, empty
/// message.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_error_init_sized(error: *mut ar_error, struct_size: u32) -> ar_status {
    // SAFETY: the caller vouches for `struct_size` writable bytes.
    unsafe {
        let status = options::init(error, struct_size);
        if status == AR_OK {
            (&raw mut (*error).first_index).write_unaligned(AR_NONE);
        }
        status
    }
}

/// A failure on its way to the caller.
#[derive(Debug)]
pub(super) struct Fail {
    pub status: ar_status,
    pub message: String,
    pub first: u64,
    pub count: u64,
}

impl Fail {
    pub fn new(status: ar_status, message: impl Into<String>) -> Fail {
        Fail { status, message: message.into(), first: AR_NONE, count: 0 }
    }

    /// A pointer that must not be NULL is.
    pub fn null(name: &str) -> Fail {
        Fail::new(AR_E_NULL, format!("{name} is NULL"))
    }

    pub fn argument(message: impl Into<String>) -> Fail {
        Fail::new(AR_E_ARGUMENT, message)
    }
}

impl From<Error> for Fail {
    fn from(error: Error) -> Fail {
        let message = error.to_string();
        let status = match error {
            Error::Index(l) => return Fail { status: AR_E_INDEX, message, first: l.first, count: l.count },
            Error::NonFinite(l) => return Fail { status: AR_E_NON_FINITE, message, first: l.first, count: l.count },
            Error::Degenerate(l) => return Fail { status: AR_E_DEGENERATE, message, first: l.first, count: l.count },
            Error::Argument(_) => AR_E_ARGUMENT,
            Error::Empty(_) => AR_E_EMPTY,
            Error::Io(_) => AR_E_IO,
            Error::Format(_) => AR_E_FORMAT,
            Error::NoMemory(_) => AR_E_NO_MEMORY,
            Error::Budget(_) => AR_E_BUDGET,
            Error::Cancelled => AR_E_CANCELLED,
            Error::Numeric(_) => AR_E_NUMERIC,
            Error::Internal(_) => AR_E_INTERNAL,
        };
        Fail::new(status, message)
    }
}

/// Writes `fail` to `error` unless that is NULL. `error` has passed [`options::check_out`].
pub(super) unsafe fn write(error: *mut ar_error, fail: &Fail) {
    if error.is_null() {
        return;
    }
    let mut message = [0; AR_MESSAGE_SIZE];
    // a NUL inside would hide the rest
    let text = fail.message.replace(['\0', '\n'], " ");
    let mut end = text.len().min(AR_MESSAGE_SIZE - 1);
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    for (to, from) in message.iter_mut().zip(text[..end].bytes()) {
        *to = from as c_char;
    }
    let value = ar_error { struct_size: 0, status: fail.status, first_index: fail.first, count: fail.count, message };
    // SAFETY: checked by the caller of this function.
    unsafe { options::write(error, value) };
}

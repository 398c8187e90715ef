//! Version.

use std::ffi::c_char;

/// Version of the interface as a number: the one in the library's SONAME (libarmesh.so.0). It changes when a
/// program built against the older header could no longer run; functions, codes and struct fields may be added
/// without changing it.
pub const AR_ABI_VERSION: u32 = 0;

/// Version of the library, "major.minor.patch". Never NULL; lives as long as the library is loaded.
#[unsafe(no_mangle)]
pub extern "C" fn ar_version() -> *const c_char {
    concat!(env!("CARGO_PKG_VERSION"), "\0").as_ptr().cast()
}

/// AR_ABI_VERSION of the library that is loaded, to compare with the header's.
#[unsafe(no_mangle)]
pub extern "C" fn ar_abi_version() -> u32 {
    AR_ABI_VERSION
}

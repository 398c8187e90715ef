//! Sized structs: how they are read, written and initialised whatever their version.

use super::error::Fail;
use super::status::*;
use std::mem::MaybeUninit;

/// A plain C struct that begins with `uint32_t struct_size`.
///
/// # Safety
/// `repr(C)`, no padding, begins with a `u32` size, and every bit pattern (all zero too) is a value.
pub(super) unsafe trait CStruct: Copy {
    /// Name in C, for messages.
    const NAME: &'static str;
    /// Size of its first version.
    const MIN: usize;
}

/// No struct will ever be this large; keeps a garbage size from reading or writing far.
const MAX: usize = 1 << 14;

/// The size that the struct at `p` claims, if it can be one. Reads four bytes.
unsafe fn claimed_size<T: CStruct>(p: *const T) -> Result<usize, Fail> {
    // SAFETY: the caller vouches for the struct, which begins with its size.
    let size = unsafe { p.cast::<u32>().read_unaligned() } as usize;
    check_size::<T>(size)?;
    Ok(size)
}

fn check_size<T: CStruct>(size: usize) -> Result<(), Fail> {
    if (T::MIN..=MAX).contains(&size) && size % 8 == 0 {
        return Ok(());
    }
    let (name, known) = (T::NAME, size_of::<T>());
    Err(Fail::new(AR_E_STRUCT, format!("{name}.struct_size is {size}, not {known}: call {name}_init first")))
}

/// Reads the struct at `p`; what an older version lacks is zero.
pub(super) unsafe fn read<T: CStruct>(p: *const T) -> Result<T, Fail> {
    if p.is_null() {
        return Err(Fail::null(T::NAME));
    }
    let mut value = MaybeUninit::<T>::zeroed();
    // SAFETY: `size` bytes are readable as the caller vouches; any bit pattern is a T.
    unsafe {
        let size = claimed_size(p)?;
        let known = size.min(size_of::<T>());
        value.as_mut_ptr().cast::<u8>().copy_from_nonoverlapping(p.cast(), known);
        if let Some(at) = (known..size).find(|&i| p.cast::<u8>().add(i).read() != 0) {
            let message = format!("byte {at} of {} is set but unknown to this version of the library", T::NAME);
            return Err(Fail::new(AR_E_STRUCT, message));
        }
        Ok(value.assume_init())
    }
}

/// Reads options: NULL gives all zero, which means all defaults.
pub(super) unsafe fn read_or_default<T: CStruct>(p: *const T) -> Result<T, Fail> {
    if p.is_null() {
        // SAFETY: all zero is a T.
        return Ok(unsafe { MaybeUninit::zeroed().assume_init() });
    }
    // SAFETY: same contract.
    unsafe { read(p) }
}

/// Checks that [`write`] may write to `p`.
pub(super) unsafe fn check_out<T: CStruct>(p: *const T) -> Result<(), Fail> {
    if p.is_null() {
        return Err(Fail::null(T::NAME));
    }
    // SAFETY: same contract.
    unsafe { claimed_size(p) }.map(|_| ())
}

/// Writes `value` to the caller's struct at its own size: an older one gets less, the unknown tail of a newer one
/// zeros. Does nothing if [`check_out`] would fail.
pub(super) unsafe fn write<T: CStruct>(p: *mut T, value: T) {
    const SKIP: usize = size_of::<u32>(); // struct_size stays the caller's
    // SAFETY: `size` bytes are writable as the caller vouches.
    unsafe {
        let Ok(size) = claimed_size(p) else { return };
        let known = size.min(size_of::<T>());
        let (to, from) = (p.cast::<u8>(), (&raw const value).cast::<u8>());
        to.add(SKIP).copy_from_nonoverlapping(from.add(SKIP), known - SKIP);
        to.add(known).write_bytes(0, size - known);
    }
}

/// Sets `size` bytes at `p` to the defaults: zero but for the size.
pub(super) unsafe fn init<T: CStruct>(p: *mut T, size: u32) -> ar_status {
    if p.is_null() {
        return AR_E_NULL;
    }
    if check_size::<T>(size as usize).is_err() {
        return AR_E_STRUCT;
    }
    // SAFETY: the caller vouches for `size` writable bytes.
    unsafe {
        p.cast::<u8>().write_bytes(0, size as usize);
        p.cast::<u32>().write_unaligned(size);
    }
    AR_OK
}

/// `value` if it is one of `allowed`, or AR_E_ARGUMENT that names `field`.
pub(super) fn check_enum(value: u32, allowed: &[u32], field: &str) -> Result<u32, Fail> {
    if allowed.contains(&value) {
        return Ok(value);
    }
    Err(Fail::argument(format!("{field} is {value}, which is none of {allowed:?}")))
}

/// AR_E_ARGUMENT if `flags` has a bit outside `allowed`.
pub(super) fn check_flags(flags: u32, allowed: u32, field: &str) -> Result<(), Fail> {
    if flags & !allowed == 0 {
        return Ok(());
    }
    Err(Fail::argument(format!("{field} has unknown bits: {:#x}", flags & !allowed)))
}

/// `value`, or `default` if it is 0; AR_E_ARGUMENT unless it is within `from..=to` (so not NaN either).
pub(super) fn or_default(value: f64, default: f64, [from, to]: [f64; 2], field: &str) -> Result<f64, Fail> {
    if value == 0.0 {
        return Ok(default);
    }
    if (from..=to).contains(&value) {
        return Ok(value);
    }
    Err(Fail::argument(format!("{field} is {value}, outside {from}..{to}")))
}

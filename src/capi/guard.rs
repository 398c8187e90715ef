//! Every call from C goes through here: panics stop, status and message go out.

use super::error::{self, Fail, ar_error};
use super::options;
use super::status::*;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};

/// Runs `body` for a call that uses no handle.
pub(super) unsafe fn guard(error: *mut ar_error, body: impl FnOnce() -> Result<(), Fail>) -> ar_status {
    // SAFETY: same contract.
    unsafe { run(error, None, body) }
}

/// Runs `body` for a call that uses the handle found by `live`; the handle is poisoned if `body` panics.
pub(super) unsafe fn guard_handle<'a, H: Handle + 'a>(
    handle: *const H,
    error: *mut ar_error,
    body: impl FnOnce(&'a H) -> Result<(), Fail>,
) -> ar_status {
    // SAFETY: the caller vouches that `handle` is NULL or a handle that nobody frees meanwhile.
    unsafe {
        match live(handle) {
            Ok(h) => run(error, Some(h.poisoned()), || {
                if h.poisoned().load(Ordering::Acquire) {
                    return Err(Fail::new(AR_E_POISONED, format!("this {} failed internally before", H::NAME)));
                }
                body(h)
            }),
            Err(fail) => run(error, None, || Err(fail)),
        }
    }
}

unsafe fn run(
    error: *mut ar_error,
    poisoned: Option<&AtomicBool>,
    body: impl FnOnce() -> Result<(), Fail>,
) -> ar_status {
    // SAFETY: the caller vouches that `error` is NULL or a struct that starts with its size.
    if !error.is_null() && unsafe { options::check_out(error) }.is_err() {
        return AR_E_STRUCT;
    }
    let fail = match catch_unwind(AssertUnwindSafe(body)) {
        Ok(Ok(())) => return AR_OK,
        Ok(Err(fail)) => fail,
        Err(panic) => {
            if let Some(flag) = poisoned {
                flag.store(true, Ordering::Release);
            }
            let text = panic.downcast_ref::<&str>().copied().or(panic.downcast_ref::<String>().map(String::as_str));
            let fail = Fail::new(AR_E_INTERNAL, format!("defect in armesh: {}", text.unwrap_or("unknown panic")));
            // dropping a payload may panic again
            std::mem::forget(panic);
            fail
        }
    };
    // SAFETY: checked above.
    unsafe { error::write(error, &fail) };
    fail.status
}

/// A type whose pointers C holds.
pub(super) trait Handle: Sized {
    /// Type name in C, for messages.
    const NAME: &'static str;
    /// Tells a live handle of this type from other memory.
    const MAGIC: u64;
    fn magic(this: *const Self) -> *const u64;
    fn poisoned(&self) -> &AtomicBool;
    /// A call that needs the handle exclusively runs.
    fn busy(&self) -> bool {
        false
    }
}

/// What a freed handle holds in place of its magic number.
const FREED: u64 = 0xDEAD_A12E_5400_0000;

/// The handle behind `pointer` if it looks like a live one.
pub(super) unsafe fn live<'a, H: Handle>(pointer: *const H) -> Result<&'a H, Fail> {
    if pointer.is_null() {
        return Err(Fail::null(H::NAME));
    }
    // SAFETY: the caller vouches that the pointer came from this library; after a free this is best effort.
    if !pointer.is_aligned() || unsafe { H::magic(pointer).read_volatile() } != H::MAGIC {
        return Err(Fail::new(AR_E_HANDLE, format!("not a live {}: was it freed already?", H::NAME)));
    }
    // SAFETY: as above.
    Ok(unsafe { &*pointer })
}

/// Hands `value` to C.
pub(super) fn leak<H: Handle>(value: H) -> *mut H {
    Box::into_raw(Box::new(value))
}

/// Frees a handle; NULL is fine, a second time gives AR_E_HANDLE if the memory still shows it.
pub(super) unsafe fn free<H: Handle>(pointer: *mut H) -> ar_status {
    if pointer.is_null() {
        return AR_OK;
    }
    let body = || {
        // SAFETY: the caller vouches for the handle and that nobody else uses it.
        unsafe {
            if live(pointer)?.busy() {
                return Err(Fail::new(AR_E_BUSY, "in use by a running call"));
            }
            H::magic(pointer).cast_mut().write_volatile(FREED);
            drop(Box::from_raw(pointer));
        }
        Ok(())
    };
    // SAFETY: no error struct.
    unsafe { run(std::ptr::null_mut(), None, body) }
}

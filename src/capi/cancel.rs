//! Cancelling from another thread.

use super::error::{Fail, ar_error};
use super::guard::{self, Handle, guard, guard_handle};
use super::status::ar_status;
use crate::job::CancelToken;
use std::sync::atomic::AtomicBool;

/// A flag that any thread may raise to stop the calls that were given it. Its functions may be called by several
/// threads at once.
pub struct ar_cancel_token {
    magic: u64,
    poisoned: AtomicBool,
    token: CancelToken,
}

impl Handle for ar_cancel_token {
    const NAME: &'static str = "ar_cancel_token";
    const MAGIC: u64 = u64::from_le_bytes(*b"armeshCT");
    fn magic(this: *const Self) -> *const u64 {
        // SAFETY: a field's address, nothing is read.
        unsafe { &raw const (*this).magic }
    }
    fn poisoned(&self) -> &AtomicBool {
        &self.poisoned
    }
}

/// Makes a token, not raised. `token`: where to put the handle; free it with ar_cancel_token_free.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_cancel_token_new(token: *mut *mut ar_cancel_token, error: *mut ar_error) -> ar_status {
    // SAFETY: the pointers are as the header demands.
    unsafe {
        guard(error, || {
            if token.is_null() {
                return Err(Fail::null("token"));
            }
            let magic = ar_cancel_token::MAGIC;
            let made = ar_cancel_token { magic, poisoned: AtomicBool::new(false), token: CancelToken::default() };
            token.write_unaligned(guard::leak(made));
            Ok(())
        })
    }
}

/// Frees a token, also while a call that was given it still runs. NULL does nothing. AR_E_HANDLE if it is
/// recognisably freed already.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_cancel_token_free(token: *mut ar_cancel_token) -> ar_status {
    // SAFETY: as the header demands.
    unsafe { guard::free(token) }
}

/// Raises the token: calls that were given it, running or to come, return AR_E_CANCELLED soon. Safe in a signal
/// handler if `error` is NULL and the token is live.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_cancel_token_cancel(token: *const ar_cancel_token, error: *mut ar_error) -> ar_status {
    // SAFETY: as the header demands.
    unsafe {
        guard_handle(token, error, |t| {
            t.token.cancel();
            Ok(())
        })
    }
}

/// Lowers the token, to use it again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_cancel_token_reset(token: *const ar_cancel_token, error: *mut ar_error) -> ar_status {
    // SAFETY: as the header demands.
    unsafe {
        guard_handle(token, error, |t| {
            t.token.reset();
            Ok(())
        })
    }
}

/// The flag behind a live token, shared with it.
pub(super) unsafe fn token(pointer: *const ar_cancel_token) -> Result<CancelToken, Fail> {
    // SAFETY: same contract.
    Ok(unsafe { guard::live(pointer)? }.token.clone())
}

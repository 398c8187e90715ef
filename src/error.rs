//! The one error type of the library.

use std::fmt;

/// What went wrong, in the categories that a caller can act on. Each carries a message that says what and where.
#[derive(Debug, Clone, PartialEq)]
pub enum Error {
    /// An option or parameter is outside its documented range.
    Argument(String),
    /// The mesh has no vertices or no faces.
    Empty(String),
    /// A face names a vertex that does not exist.
    Index(Located),
    /// A coordinate is NaN or infinite.
    NonFinite(Located),
    /// No face has an area: nothing can be measured.
    Degenerate(Located),
    /// A file could not be read or written.
    Io(String),
    /// A file is not what its name or header says, or is damaged.
    Format(String),
    /// An allocation sized by the input failed.
    NoMemory(String),
    /// The memory budget of the job does not allow the next step.
    Budget(String),
    /// The caller cancelled.
    Cancelled,
    /// A linear solve did not reach its residual, or a similar numerical failure.
    Numeric(String),
    /// A defect of the library itself.
    Internal(String),
}

/// A message about offending items of the input with their count and the first one's index.
#[derive(Debug, Clone, PartialEq)]
pub struct Located {
    /// What is wrong, in words, with coordinates where there are any.
    pub message: String,
    /// Index of the first offending face or vertex (the message says which).
    pub first: u64,
    /// Number of offending items.
    pub count: u64,
}

/// Shorthand used throughout the crate.
pub type Result<T> = std::result::Result<T, Error>;

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::Argument(m)
            | Error::Empty(m)
            | Error::Io(m)
            | Error::Format(m)
            | Error::NoMemory(m)
            | Error::Budget(m)
            | Error::Numeric(m)
            | Error::Internal(m) => f.write_str(m),
            Error::Index(l) | Error::NonFinite(l) | Error::Degenerate(l) => f.write_str(&l.message),
            Error::Cancelled => f.write_str("cancelled by the caller"),
        }
    }
}

impl std::error::Error for Error {}

/// A vector with room for `n` elements, or [`Error::NoMemory`] that names `what`.
pub fn try_vec<T>(n: usize, what: &str) -> Result<Vec<T>> {
    let mut v = Vec::new();
    v.try_reserve_exact(n).map_err(|_| {
        Error::NoMemory(format!("out of memory: {what} needs {} bytes", n.saturating_mul(size_of::<T>())))
    })?;
    Ok(v)
}

/// [`Vec::push`] that is [`Error::NoMemory`], naming `what`, instead of aborting when memory is out.
pub fn try_push<T>(v: &mut Vec<T>, value: T, what: &str) -> Result<()> {
    v.try_reserve(1).map_err(|_| Error::NoMemory(format!("out of memory: {what}")))?;
    v.push(value);
    Ok(())
}

/// A vector of `n` copies of `value`, or [`Error::NoMemory`] that names `what`.
pub fn try_filled<T: Clone>(n: usize, value: T, what: &str) -> Result<Vec<T>> {
    let mut v = try_vec(n, what)?;
    v.resize(n, value);
    Ok(v)
}

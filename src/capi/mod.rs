//! The C boundary: the only room with `unsafe`, one file per C noun, no algorithm.

//! Pointers with counts and strides: the caller's buffers as a mesh, and results copied out.

use super::error::Fail;
use super::mesh::*;
use super::options::check_enum;
use super::status::AR_E_CAPACITY;
use crate::mesh::MeshSource;

/// `count` rows of bytes in the caller's memory, `stride` apart.
struct Rows {
    start: *const u8,
    count: usize,
    stride: usize,
}

impl Rows {
    /// Checks that `count` rows of `row` bytes, `stride` apart (0 = tight), can lie in memory at `start`.
    fn new(start: *const u8, count: u64, stride: u64, row: u64, [rows, strided]: [&str; 2]) -> Result<Rows, Fail> {
        if start.is_null() && count > 0 {
            return Err(Fail::null(rows));
        }
        let stride = if stride == 0 { row } else { stride };
        if stride < row {
            return Err(Fail::argument(format!(
                "{strided} is {stride}, below the {row} bytes that a row of {rows} has"
            )));
        }
        let bytes = count.saturating_sub(1).checked_mul(stride).and_then(|b| b.checked_add(row));
        match bytes.map(usize::try_from) {
            Some(Ok(b)) if b <= isize::MAX as usize - start.addr().min(isize::MAX as usize) => {}
            _ => return Err(Fail::argument(format!("{count} {rows}, {stride} bytes apart, do not fit in memory"))),
        }
        Ok(Rows { start, count: count as usize, stride: stride as usize })
    }

    /// Three numbers of row `i`, which may be unaligned.
    fn get<T: Copy>(&self, i: usize) -> [T; 3] {
        assert!(i < self.count);
        // SAFETY: the row lies within what `new` checked and the caller vouched for.
        unsafe { self.start.add(i * self.stride).cast::<[T; 3]>().read_unaligned() }
    }
}

/// The buffers of an ar_mesh_desc.
pub(super) struct Buffers {
    positions: Rows,
    double: bool,
    triangles: Rows,
    signed: bool,
}

// SAFETY: the memory is only read, and outlives the call that holds this.
unsafe impl Sync for Buffers {}

impl Buffers {
    /// Checks types, strides and extents. What the pointers lead to is the caller's word.
    pub unsafe fn new(desc: &ar_mesh_desc) -> Result<Buffers, Fail> {
        let double = check_enum(desc.position_type, &[AR_FLOAT32, AR_FLOAT64], "position_type")? == AR_FLOAT64;
        let signed = check_enum(desc.index_type, &[AR_INT32, AR_UINT32], "index_type")? == AR_INT32;
        let row = if double { 24 } else { 12 };
        let names = ["positions", "position_stride"];
        let positions = Rows::new(desc.positions.cast(), desc.vertex_count, desc.position_stride, row, names)?;
        let names = ["triangles", "triangle_stride"];
        let triangles = Rows::new(desc.triangles.cast(), desc.face_count, desc.triangle_stride, 12, names)?;
        Ok(Buffers { positions, double, triangles, signed })
    }
}

impl MeshSource for Buffers {
    fn vertex_count(&self) -> usize {
        self.positions.count
    }
    fn position(&self, i: usize) -> [f64; 3] {
        if self.double { self.positions.get(i) } else { self.positions.get::<f32>(i).map(f64::from) }
    }
    fn face_count(&self) -> usize {
        self.triangles.count
    }
    fn triangle(&self, f: usize) -> [i64; 3] {
        if self.signed {
            self.triangles.get::<i32>(f).map(i64::from)
        } else {
            self.triangles.get::<u32>(f).map(i64::from)
        }
    }
}

/// The caller's buffer for a result.
pub(super) struct Out<T> {
    pub buffer: *mut T,
    pub capacity: usize,
    pub count: *mut usize,
}

impl<T> Out<T> {
    /// Copies out `n` elements of `N` numbers each, by the rules for buffers in the header's conventions.
    pub unsafe fn fill<const N: usize>(self, n: usize, element: impl Fn(usize) -> [T; N]) -> Result<(), Fail> {
        if self.buffer.is_null() && self.count.is_null() {
            return Err(Fail::null("the buffer and count"));
        }
        // SAFETY: the caller vouches for `count` and for `capacity` elements.
        unsafe {
            if !self.count.is_null() {
                self.count.write_unaligned(n);
            }
            if self.buffer.is_null() {
                return Ok(());
            }
            if self.capacity < n {
                return Err(Fail::new(AR_E_CAPACITY, format!("capacity is {}, {n} needed", self.capacity)));
            }
            for i in 0..n {
                self.buffer.cast::<[T; N]>().add(i).write_unaligned(element(i));
            }
        }
        Ok(())
    }

    /// The checks of [`Out::fill`], for use before long work.
    pub unsafe fn check(&self, n: usize) -> Result<(), Fail> {
        if self.buffer.is_null() || self.capacity < n {
            let probe = Out { buffer: self.buffer, capacity: self.capacity, count: self.count };
            // SAFETY: nothing is written but the count.
            return unsafe { probe.fill::<1>(n, |_| unreachable!("the capacity is too small")) };
        }
        Ok(())
    }
}

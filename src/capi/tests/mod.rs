//! The boundary with raw pointers, as C uses it: what it refuses, what it leaves alone.

mod intake;
mod results;
mod running;
mod structs;

use super::cancel::*;
use super::compute::*;
use super::diagnostics::*;
use super::error::*;
use super::geodesic::*;
use super::guard::{guard, guard_handle};
use super::mesh::*;
use super::ply::*;
use super::progress::*;
use super::results::*;
use super::segment::*;
use super::status::*;
use crate::mesh::shapes;
use std::ffi::{CStr, c_char, c_void};
use std::mem::{MaybeUninit, size_of};
use std::ptr::{null, null_mut};

fn name(status: ar_status) -> String {
    // SAFETY: static and NUL-terminated.
    unsafe { CStr::from_ptr(ar_status_name(status)) }.to_str().unwrap().into()
}

fn error() -> ar_error {
    let mut e = MaybeUninit::<ar_error>::uninit();
    // SAFETY: as C calls it.
    unsafe {
        assert_eq!(ar_error_init_sized(e.as_mut_ptr(), size_of::<ar_error>() as u32), AR_OK);
        e.assume_init()
    }
}

fn message(e: &ar_error) -> String {
    let bytes: Vec<u8> = e.message.iter().map(|&c| c as u8).take_while(|&c| c != 0).collect();
    assert!(bytes.len() < AR_MESSAGE_SIZE);
    String::from_utf8(bytes).unwrap()
}

/// Buffers of a cube, and the description of them.
struct Cube {
    xyz: Vec<f32>,
    ijk: Vec<i32>,
    desc: ar_mesh_desc,
}

fn cube() -> Cube {
    let (p, t) = shapes::cuboid([1.0, 1.0, 1.0]);
    let xyz: Vec<f32> = p.iter().flatten().map(|&x| x as f32).collect();
    let ijk: Vec<i32> = t.iter().flatten().map(|&v| v as i32).collect();
    let mut desc = zeroed::<ar_mesh_desc>();
    desc.struct_size = size_of::<ar_mesh_desc>() as u32;
    (desc.positions, desc.vertex_count, desc.position_type) = (xyz.as_ptr().cast(), p.len() as u64, AR_FLOAT32);
    (desc.triangles, desc.face_count, desc.index_type) = (ijk.as_ptr().cast(), t.len() as u64, AR_INT32);
    Cube { xyz, ijk, desc }
}

fn zeroed<T: crate::capi::options::CStruct>() -> T {
    // SAFETY: all zero is valid for these.
    unsafe { MaybeUninit::zeroed().assume_init() }
}

fn make(desc: &ar_mesh_desc) -> Result<*mut ar_mesh, (String, ar_error)> {
    let (mut mesh, mut e) = (null_mut(), error());
    // SAFETY: as C calls it.
    let status = unsafe { ar_mesh_new(desc, &mut mesh, &mut e) };
    if status == AR_OK {
        return Ok(mesh);
    }
    assert!(mesh.is_null() && e.status == status, "the handle is untouched and the error is filled");
    Err((name(status), e))
}

fn refusal(desc: &ar_mesh_desc) -> (String, String) {
    let (name, e) = make(desc).unwrap_err();
    (name, message(&e))
}

fn computed() -> *mut ar_mesh {
    let mesh = make(&cube().desc).unwrap();
    // SAFETY: as C calls it.
    assert_eq!(unsafe { ar_compute(mesh, null(), null_mut()) }, AR_OK);
    mesh
}

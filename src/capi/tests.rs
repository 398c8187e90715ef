//! The boundary with raw pointers, as C uses it: what it refuses, what it leaves alone.

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

fn zeroed<T: super::options::CStruct>() -> T {
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

#[test]
fn codes_have_their_names() {
    let lines = include_str!("status.rs").lines();
    let constants = lines.filter_map(|l| l.strip_prefix("pub const ")?.split_once(": ar_status"));
    let mut next = 0;
    for (constant, value) in constants {
        assert_eq!(value.trim_matches([' ', '=', ';']).parse(), Ok(next));
        assert_eq!(name(next), constant);
        next -= 1;
    }
    assert_eq!(next, AR_E_BUSY - 1);
    for odd in [1, -20, i32::MIN, i32::MAX] {
        assert_eq!(name(odd), "AR_E_UNKNOWN");
    }
    // SAFETY: static and NUL-terminated.
    let stage = |s| unsafe { CStr::from_ptr(ar_stage_name(s)) }.to_str().unwrap();
    use crate::job::Stage::*;
    for s in [Mesh, Surface, Thickness, Factor, Geodesic, Segment] {
        assert_eq!(stage(s as u32), s.name());
    }
    assert_eq!(stage(99), "unknown");
}

#[test]
fn null_is_refused_everywhere() {
    let (none, some) = (null_mut::<ar_mesh>(), computed());
    let mut e = error();
    let (path, mut token) = (c"x.ply".as_ptr(), null_mut());
    // SAFETY: NULL is what is tested.
    unsafe {
        let calls = [
            ar_error_init_sized(null_mut(), 536),
            ar_mesh_desc_init_sized(null_mut(), 112),
            ar_mesh_new(null(), &mut null_mut(), &mut e),
            ar_mesh_new(&cube().desc, null_mut(), &mut e),
            ar_mesh_load(null(), null(), &mut null_mut(), &mut e),
            ar_mesh_load(path, null(), null_mut(), &mut e),
            ar_mesh_get_positions(none, null_mut(), 0, &mut 0, &mut e),
            ar_mesh_get_positions(some, null_mut(), 0, null_mut(), &mut e),
            ar_mesh_get_triangles(none, null_mut(), 0, &mut 0, &mut e),
            ar_mesh_get_warnings(none, null_mut(), 0, &mut 0, &mut e),
            ar_mesh_get_diagnostics(none, &mut zeroed(), &mut e),
            ar_mesh_get_diagnostics(some, null_mut(), &mut e),
            ar_compute(none, null(), &mut e),
            ar_get_vertex_d1(none, null_mut(), 0, &mut 0, &mut e),
            ar_get_vertex_d2(none, null_mut(), 0, &mut 0, &mut e),
            ar_get_vertex_ratio(none, null_mut(), 0, &mut 0, &mut e),
            ar_get_vertex_ratio(some, null_mut(), 0, null_mut(), &mut e),
            ar_get_vertex_reason(none, null_mut(), 0, &mut 0, &mut e),
            ar_get_vertex_farthest(none, null_mut(), 0, &mut 0, &mut e),
            ar_get_face_d2(none, null_mut(), 0, &mut 0, &mut e),
            ar_get_summary(none, &mut zeroed(), &mut e),
            ar_get_summary(some, null_mut(), &mut e),
            ar_get_histogram(none, AR_D1, null_mut(), null_mut(), 1, &mut e),
            ar_get_histogram(some, AR_D1, null_mut(), &mut 0.0, 1, &mut e),
            ar_get_histogram(some, AR_D1, [0.0; 2].as_mut_ptr(), null_mut(), 1, &mut e),
            ar_geodesic_distance(none, 0, null(), null_mut(), 0, &mut 0, &mut e),
            ar_mesh_write_ply(none, path, AR_D1, &mut e),
            ar_mesh_write_ply(some, null(), AR_D1, &mut e),
            ar_cancel_token_new(null_mut(), &mut e),
            ar_cancel_token_cancel(null(), &mut e),
            ar_cancel_token_reset(null(), &mut e),
        ];
        assert_eq!(calls.map(name), calls.map(|_| "AR_E_NULL".to_string()));
        assert_eq!((ar_mesh_free(null_mut()), ar_cancel_token_free(null_mut())), (AR_OK, AR_OK));
        // and no error struct is fine everywhere
        assert_eq!(ar_mesh_new(null(), null_mut(), null_mut()), AR_E_NULL);
        assert_eq!(ar_cancel_token_new(&mut token, null_mut()), AR_OK);
        assert_eq!((ar_cancel_token_free(token), ar_mesh_free(some)), (AR_OK, AR_OK));
    }
}

#[test]
fn bad_descriptions_are_refused_and_located() {
    let good = cube();
    let with = |change: &dyn Fn(&mut ar_mesh_desc)| {
        let mut desc = good.desc;
        change(&mut desc);
        refusal(&desc)
    };
    let (code, text) = with(&|d| d.positions = null());
    assert_eq!((code.as_str(), text.as_str()), ("AR_E_NULL", "positions is NULL"));
    assert_eq!(with(&|d| d.triangles = null()).0, "AR_E_NULL");
    assert_eq!(with(&|d| (d.vertex_count, d.positions) = (0, null())).0, "AR_E_EMPTY");
    assert_eq!(with(&|d| d.face_count = 0).0, "AR_E_EMPTY");
    for change in [
        (|d| d.position_type = 0) as fn(&mut ar_mesh_desc),
        |d| d.position_type = 3,
        |d| d.index_type = 0,
        |d| d.weld = 3,
        |d| d.flags = 2,
        |d| d.position_stride = 11,
        |d| d.triangle_stride = 4,
        |d| d.vertex_count = u64::MAX,
        |d| d.position_stride = u64::MAX / 4,
        |d| d.vertex_count = 1 << 62,
        |d| d.face_count = 1 << 40,
        |d| d.threads = u32::MAX,
        |d| d.weld_tolerance = 1.0,
        |d| d.weld = AR_WELD_TOLERANCE,
    ] {
        let (code, text) = with(&change);
        assert_eq!(code, "AR_E_ARGUMENT", "{text}");
    }
    let mut bad = cube();
    bad.ijk[3 * 5 + 2] = -7;
    let (code, e) = make(&bad.desc).unwrap_err();
    assert_eq!((code.as_str(), e.first_index, e.count), ("AR_E_INDEX", 5, 1));
    let text = message(&e);
    assert!(["face 5", "corner 2", "-7"].iter().all(|part| text.contains(part)), "{text}");
    bad.desc.index_type = AR_UINT32;
    assert!(refusal(&bad.desc).1.contains("4294967289"));
    bad.xyz[3 * 4 + 1] = f32::INFINITY;
    let (code, e) = make(&bad.desc).unwrap_err();
    assert_eq!((code.as_str(), e.first_index), ("AR_E_NON_FINITE", 4));
    bad.desc.memory_budget = 1;
    assert_eq!(refusal(&bad.desc).0, "AR_E_BUDGET");
}

#[test]
fn strides_and_alignment_do_not_matter() {
    let plain = cube();
    // rows of 29 and 17 bytes, at odd addresses
    let (mut p, mut t) = (vec![0xFFu8; 1 + 29 * 8], vec![0xFFu8; 3 + 17 * 12]);
    for (i, row) in plain.xyz.chunks(3).enumerate() {
        let bytes: Vec<u8> = row.iter().flat_map(|&x| f64::from(x).to_ne_bytes()).collect();
        p[1 + 29 * i..][..24].copy_from_slice(&bytes);
    }
    for (f, row) in plain.ijk.chunks(3).enumerate() {
        let bytes: Vec<u8> = row.iter().flat_map(|&v| v.to_ne_bytes()).collect();
        t[3 + 17 * f..][..12].copy_from_slice(&bytes);
    }
    // the last rows end with their numbers, not with their stride
    p.truncate(1 + 29 * 7 + 24);
    t.truncate(3 + 17 * 11 + 12);
    let mut desc = plain.desc;
    (desc.positions, desc.position_stride, desc.position_type) = (p[1..].as_ptr().cast(), 29, AR_FLOAT64);
    (desc.triangles, desc.triangle_stride, desc.index_type) = (t[3..].as_ptr().cast(), 17, AR_UINT32);
    let mesh = make(&desc).unwrap();
    let (mut xyz, mut ijk, mut n) = ([0.0; 24], [0; 36], 0);
    // SAFETY: as C calls it.
    unsafe {
        assert_eq!(ar_mesh_get_positions(mesh, xyz.as_mut_ptr(), 8, &mut n, null_mut()), AR_OK);
        assert_eq!(n, 8);
        assert_eq!(ar_mesh_get_triangles(mesh, ijk.as_mut_ptr(), 12, &mut n, null_mut()), AR_OK);
        assert_eq!(n, 12);
        ar_mesh_free(mesh);
    }
    assert!(xyz.iter().zip(&plain.xyz).all(|(&a, &b)| a == f64::from(b)));
    assert!(ijk.iter().zip(&plain.ijk).all(|(&a, &b)| a == b as u32));
}

#[test]
fn welded_and_skipped_items_keep_their_numbers() {
    let mut c = cube();
    // vertex 8 = vertex 3 again, used by face 0; 9 is not finite, used by face 12; 10 is used by nothing
    let again = c.xyz[9..12].to_vec();
    c.xyz.extend(again);
    c.xyz.extend([f32::NAN, 0.0, 0.0, 9.0, 9.0, 9.0]);
    for v in c.ijk.iter_mut().filter(|v| **v == 3).take(1) {
        *v = 8;
    }
    c.ijk.extend([0, 1, 9, 1, 1, 2]);
    (c.desc.positions, c.desc.vertex_count) = (c.xyz.as_ptr().cast(), 11);
    (c.desc.triangles, c.desc.face_count) = (c.ijk.as_ptr().cast(), 14);
    c.desc.flags = AR_MESH_SKIP_INVALID;
    let mesh = make(&c.desc).unwrap();
    let (mut ijk, mut d1, mut reason, mut d2) = ([0u32; 42], [0.0; 11], [0u32; 11], [0.0; 14]);
    // SAFETY: as C calls it.
    unsafe {
        assert_eq!(ar_mesh_get_triangles(mesh, ijk.as_mut_ptr(), 14, null_mut(), null_mut()), AR_OK);
        assert_eq!(ar_compute(mesh, null(), null_mut()), AR_OK);
        assert_eq!(ar_get_vertex_d1(mesh, d1.as_mut_ptr(), 11, null_mut(), null_mut()), AR_OK);
        assert_eq!(ar_get_vertex_reason(mesh, reason.as_mut_ptr(), 11, null_mut(), null_mut()), AR_OK);
        assert_eq!(ar_get_face_d2(mesh, d2.as_mut_ptr(), 14, null_mut(), null_mut()), AR_OK);
        let mut d = zeroed::<ar_diagnostics>();
        d.struct_size = size_of::<ar_diagnostics>() as u32;
        assert_eq!(ar_mesh_get_diagnostics(mesh, &mut d, null_mut()), AR_OK);
        assert_eq!((d.vertex_count, d.face_count, d.welded_vertex_count, d.used_face_count), (11, 14, 9, 12));
        assert_eq!((d.non_finite_vertices.count, d.non_finite_vertices.first), (1, 9));
        assert_eq!((d.unreferenced_vertices.count, d.unreferenced_vertices.first), (1, 10));
        assert_eq!((d.collapsed_faces.count, d.collapsed_faces.first), (2, 12));
        assert_eq!((d.boundary_edges.count, d.boundary_edges.first), (0, AR_NONE));
        assert_eq!((d.components, d.closed, d.orientable), (1, 1, 1));
        assert!((d.volume - 1.0).abs() < 1e-12 && (d.area - 6.0).abs() < 1e-12);
        ar_mesh_free(mesh);
    }
    assert_eq!(
        ijk[..36].iter().filter(|&&v| v == 3).count(),
        c.ijk[..36].iter().filter(|&&v| v == 3 || v == 8).count()
    );
    assert_eq!(ijk[36..], [u32::MAX; 6]);
    assert!(d1[8] == d1[3] && d1[3] > 0.0 && d1[9].is_nan() && d1[10].is_nan(), "{d1:?}");
    assert_eq!((reason[8], reason[9], reason[10]), (0, AR_REASON_NON_FINITE, AR_REASON_UNREFERENCED));
    assert!(d2[0] > 0.0 && d2[12].is_nan() && d2[13].is_nan(), "{d2:?}");
}

#[test]
fn struct_sizes_old_new_and_wrong() {
    let c = cube();
    for size in [0u32, 4, 8, 104, 113, 1 << 20, u32::MAX] {
        let mut desc = c.desc;
        desc.struct_size = size;
        let (code, text) = refusal(&desc);
        assert!(code == "AR_E_STRUCT" && text.contains(&size.to_string()), "{size}: {code} {text}");
    }
    // a caller of a later version: the tail unknown here must be zero
    #[repr(C)]
    struct Later {
        desc: ar_mesh_desc,
        more: [u64; 2],
    }
    let mut later = Later { desc: c.desc, more: [0, 0] };
    later.desc.struct_size = size_of::<Later>() as u32;
    // SAFETY: as C calls it.
    let new = |later: &Later| unsafe {
        let (mut mesh, mut e) = (null_mut(), error());
        let status = ar_mesh_new((&raw const *later).cast(), &mut mesh, &mut e);
        ar_mesh_free(mesh);
        (status, message(&e))
    };
    assert_eq!(new(&later).0, AR_OK);
    later.more[1] = 1 << 56;
    let (status, text) = new(&later);
    assert!(status == AR_E_STRUCT && text.contains("byte 127"), "{text}");
}

#[test]
fn output_structs_old_new_and_wrong() {
    let mesh = computed();
    #[repr(C)]
    struct Later {
        summary: ar_summary,
        more: [u64; 2],
    }
    let mut later = Later { summary: zeroed(), more: [7, 7] };
    // SAFETY: as C calls it.
    unsafe {
        later.summary.struct_size = size_of::<Later>() as u32;
        assert_eq!(ar_get_summary(mesh, &raw mut later.summary, null_mut()), AR_OK);
        assert_eq!((later.summary.struct_size as usize, later.more), (size_of::<Later>(), [0, 0]));
        assert!(later.summary.d1_max > 0.0);
        later.summary.struct_size = 16;
        later.summary.d1_max = -1.0;
        assert_eq!(ar_get_summary(mesh, &raw mut later.summary, null_mut()), AR_E_STRUCT);
        assert_eq!(later.summary.d1_max, -1.0);
        // an error struct that cannot be used is itself an error, and nothing is done
        let mut e = error();
        e.struct_size = 0;
        let mut n = 77;
        assert_eq!(ar_get_vertex_d1(mesh, null_mut(), 0, &mut n, &mut e), AR_E_STRUCT);
        assert_eq!((n, e.status), (77, AR_OK));
        ar_mesh_free(mesh);
    }
}

/// A struct whose first version was shorter.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
struct Grown {
    struct_size: u32,
    first: u32,
    second: u64,
}

// SAFETY: integers without padding.
unsafe impl super::options::CStruct for Grown {
    const NAME: &'static str = "grown";
    const MIN: usize = 8;
}

#[test]
fn a_struct_of_the_first_version_is_not_read_or_written_past_its_end() {
    let mut memory = [8u32, 5, 99, 99];
    let p = memory.as_mut_ptr().cast::<Grown>();
    // SAFETY: eight bytes belong to the struct.
    unsafe {
        let read = super::options::read(p).unwrap();
        assert_eq!(read, Grown { struct_size: 8, first: 5, second: 0 });
        super::options::write(p, Grown { struct_size: 1, first: 6, second: 7 });
        assert_eq!(memory, [8, 6, 99, 99]);
        assert_eq!(super::options::init(memory.as_mut_ptr().cast::<Grown>(), 8), AR_OK);
    }
    assert_eq!(memory, [8, 0, 99, 99]);
}

#[test]
fn buffers_follow_the_capacity_rules() {
    let mesh = computed();
    let (mut out, mut n, mut e) = ([-1.0; 8], 0, error());
    // SAFETY: as C calls it.
    unsafe {
        assert_eq!(ar_get_vertex_ratio(mesh, null_mut(), 0, &mut n, &mut e), AR_OK);
        assert_eq!(n, 8);
        n = 0;
        assert_eq!(ar_get_vertex_ratio(mesh, out.as_mut_ptr(), 7, &mut n, &mut e), AR_E_CAPACITY);
        assert!(n == 8 && e.status == AR_E_CAPACITY && out == [-1.0; 8], "{}", message(&e));
        assert_eq!(ar_get_vertex_ratio(mesh, out.as_mut_ptr(), 7, null_mut(), null_mut()), AR_E_CAPACITY);
        assert_eq!(ar_get_vertex_ratio(mesh, out.as_mut_ptr(), 8, null_mut(), null_mut()), AR_OK);
        assert!(out.iter().all(|&r| r > 0.0));
        let distance = |out: *mut f64, capacity, n| ar_geodesic_distance(mesh, 0, null(), out, capacity, n, null_mut());
        out = [-1.0; 8];
        (n, _) = (0, distance(out.as_mut_ptr(), 3, &mut n));
        assert_eq!(out, [-1.0; 8]);
        assert_eq!((distance(null_mut(), 0, &mut n), n), (AR_OK, 8));
        assert_eq!(distance(out.as_mut_ptr(), 8, null_mut()), AR_OK);
        assert!(out[0] == 0.0 && out[1..].iter().all(|&d| d > 0.0), "{out:?}");
        assert_eq!(ar_geodesic_distance(mesh, 8, null(), out.as_mut_ptr(), 8, null_mut(), &mut e), AR_E_ARGUMENT);
        assert_eq!(ar_get_histogram(mesh, 3, out.as_mut_ptr(), out.as_mut_ptr(), 1, &mut e), AR_E_ARGUMENT);
        assert_eq!(ar_get_histogram(mesh, AR_D1, out.as_mut_ptr(), out.as_mut_ptr(), 0, &mut e), AR_E_ARGUMENT);
        ar_mesh_free(mesh);
    }
}

#[test]
fn bounds_hold_d1_and_come_in_pairs() {
    let mesh = computed();
    let (mut lower, mut upper, mut d1) = ([-1.0; 8], [-1.0; 8], [0.0; 8]);
    let (mut n, mut e) = (0, error());
    // SAFETY: as C calls it.
    unsafe {
        let get = ar_get_vertex_d1_bounds;
        assert_eq!((get(mesh, null_mut(), null_mut(), 0, &mut n, &mut e), n), (AR_OK, 8));
        assert_eq!(get(mesh, lower.as_mut_ptr(), null_mut(), 8, &mut n, &mut e), AR_E_ARGUMENT);
        assert_eq!(get(mesh, lower.as_mut_ptr(), upper.as_mut_ptr(), 7, &mut n, &mut e), AR_E_CAPACITY);
        assert_eq!((lower, upper), ([-1.0; 8], [-1.0; 8]));
        assert_eq!(get(mesh, lower.as_mut_ptr(), upper.as_mut_ptr(), 8, null_mut(), &mut e), AR_OK);
        assert_eq!(ar_get_vertex_d1(mesh, d1.as_mut_ptr(), 8, null_mut(), &mut e), AR_OK);
        ar_mesh_free(mesh);
    }
    for v in 0..8 {
        assert!(lower[v] <= d1[v] && d1[v] <= upper[v], "{v}: {} {} {}", lower[v], d1[v], upper[v]);
    }
}

#[test]
fn nothing_is_read_before_it_is_computed() {
    let mesh = make(&cube().desc).unwrap();
    let mut n = 5;
    let mut summary = zeroed::<ar_summary>();
    summary.struct_size = size_of::<ar_summary>() as u32;
    // SAFETY: as C calls it.
    unsafe {
        let calls = [
            ar_get_vertex_d1(mesh, null_mut(), 0, &mut n, null_mut()),
            ar_get_face_d2(mesh, null_mut(), 0, &mut n, null_mut()),
            ar_get_vertex_reason(mesh, null_mut(), 0, &mut n, null_mut()),
            ar_get_summary(mesh, &mut summary, null_mut()),
            ar_mesh_write_ply(mesh, c"/nonexistent/x.ply".as_ptr(), AR_D1, null_mut()),
        ];
        assert_eq!(calls, [AR_E_NOT_COMPUTED; 5]);
        assert_eq!((n, ar_mesh_free(mesh)), (5, AR_OK));
    }
}

#[test]
fn odd_options_are_refused() {
    let mesh = computed();
    for change in [
        (|o| o.profile = 2) as fn(&mut ar_compute_options),
        |o| o.d1_method = 77,
        |o| o.d2_method = 77,
        |o| o.rays = 4097,
        |o| o.d1_tolerance = -0.1,
        |o| (o.d1_method, o.d1_tolerance) = (AR_D1_ALL_VERTICES, 0.1),
        |o| o.cone_angle = f64::NAN,
        |o| o.cone_angle = -1.0,
        |o| o.cone_angle = 3.2,
        |o| o.time_factor = f64::INFINITY,
        |o| o.time_factor = 1e-9,
        |o| o.threads = 100_000,
    ] {
        let mut options = zeroed::<ar_compute_options>();
        options.struct_size = size_of::<ar_compute_options>() as u32;
        change(&mut options);
        // SAFETY: as C calls it.
        let status = unsafe { ar_compute(mesh, &options, null_mut()) };
        assert_eq!(name(status), "AR_E_ARGUMENT");
    }
    // SAFETY: as C calls it.
    unsafe { ar_mesh_free(mesh) };
}

/// What the progress function below is given.
struct Watch {
    mesh: *mut ar_mesh,
    seen: Vec<f64>,
    answer: i32,
    statuses: Vec<ar_status>,
}

unsafe extern "C" fn watch(user: *mut c_void, fraction: f64, stage: u32) -> i32 {
    // SAFETY: `user` is the Watch of the caller, which is not used meanwhile.
    unsafe {
        let w = &mut *user.cast::<Watch>();
        assert!(stage <= AR_STAGE_SEGMENT);
        w.seen.push(fraction);
        w.statuses = vec![ar_compute(w.mesh, null(), null_mut()), ar_mesh_free(w.mesh)];
        w.answer
    }
}

fn watched(mesh: *mut ar_mesh, answer: i32) -> (ar_status, Watch) {
    let mut w = Watch { mesh, seen: vec![], answer, statuses: vec![] };
    let mut options = zeroed::<ar_compute_options>();
    options.struct_size = size_of::<ar_compute_options>() as u32;
    (options.progress, options.user) = (Some(watch as _), (&raw mut w).cast());
    // SAFETY: as C calls it.
    let status = unsafe { ar_compute(mesh, &options, null_mut()) };
    (status, w)
}

#[test]
fn progress_arrives_cancels_and_cannot_take_the_mesh_away() {
    let mesh = make(&cube().desc).unwrap();
    let (status, w) = watched(mesh, 1);
    assert_eq!((status, w.seen.len()), (AR_E_CANCELLED, 1));
    let mut n = 0;
    // SAFETY: as C calls it.
    let d1 = |n: &mut usize| unsafe { ar_get_vertex_d1(mesh, null_mut(), 0, n, null_mut()) };
    assert_eq!(d1(&mut n), AR_E_NOT_COMPUTED);
    let (status, w) = watched(mesh, 0);
    assert_eq!((status, d1(&mut n)), (AR_OK, AR_OK));
    assert!(w.seen.windows(2).all(|f| f[0] <= f[1]) && w.seen.last() == Some(&1.0));
    assert_eq!(w.statuses, [AR_E_BUSY, AR_E_BUSY]);
    // a later cancel leaves the results
    assert_eq!((watched(mesh, 5).0, d1(&mut n)), (AR_E_CANCELLED, AR_OK));
    // SAFETY: as C calls it.
    unsafe { ar_mesh_free(mesh) };
}

#[test]
fn a_token_cancels_until_reset() {
    let (mesh, mut token) = (make(&cube().desc).unwrap(), null_mut());
    let mut options = zeroed::<ar_compute_options>();
    // SAFETY: as C calls it.
    unsafe {
        assert_eq!(ar_cancel_token_new(&mut token, null_mut()), AR_OK);
        (options.struct_size, options.cancel) = (size_of::<ar_compute_options>() as u32, token);
        assert_eq!(ar_cancel_token_cancel(token, null_mut()), AR_OK);
        assert_eq!(ar_compute(mesh, &options, null_mut()), AR_E_CANCELLED);
        assert_eq!(ar_cancel_token_reset(token, null_mut()), AR_OK);
        assert_eq!(ar_compute(mesh, &options, null_mut()), AR_OK);
        // a handle of another type is no token
        options.cancel = mesh.cast();
        assert_eq!(ar_compute(mesh, &options, null_mut()), AR_E_HANDLE);
        assert_eq!((ar_cancel_token_free(token), ar_mesh_free(mesh)), (AR_OK, AR_OK));
    }
}

#[test]
fn a_budget_is_kept_and_results_stay() {
    let mesh = computed();
    let mut options = zeroed::<ar_compute_options>();
    (options.struct_size, options.memory_budget) = (size_of::<ar_compute_options>() as u32, 1);
    let (mut out, mut e) = ([-1.0; 8], error());
    // SAFETY: as C calls it.
    unsafe {
        assert_eq!(ar_compute(mesh, &options, &mut e), AR_E_BUDGET, "{}", message(&e));
        assert_eq!(ar_geodesic_distance(mesh, 0, &options, out.as_mut_ptr(), 8, null_mut(), &mut e), AR_E_BUDGET);
        assert_eq!(out, [-1.0; 8]);
        assert_eq!(ar_get_vertex_d1(mesh, out.as_mut_ptr(), 8, null_mut(), null_mut()), AR_OK);
        ar_mesh_free(mesh);
    }
}

/// Eight fields, several threads at once, twice: the same bits.
#[test]
fn getters_run_at_once_and_threads_do_not_change_results() {
    let run = |threads| {
        let mesh = make(&cube().desc).unwrap();
        let mut options = zeroed::<ar_compute_options>();
        (options.struct_size, options.threads) = (size_of::<ar_compute_options>() as u32, threads);
        // SAFETY: as C calls it.
        assert_eq!(unsafe { ar_compute(mesh, &options, null_mut()) }, AR_OK);
        let address = mesh as usize;
        let read = move || {
            let mut out = [0.0f64; 8];
            let mesh = address as *const ar_mesh;
            // SAFETY: const pointers may be shared.
            assert_eq!(unsafe { ar_get_vertex_ratio(mesh, out.as_mut_ptr(), 8, null_mut(), null_mut()) }, AR_OK);
            out.map(f64::to_bits)
        };
        let seen = std::thread::scope(|s| [0; 8].map(|_| s.spawn(read)).map(|t| t.join().unwrap()));
        // SAFETY: as C calls it.
        unsafe { ar_mesh_free(mesh) };
        assert!(seen.iter().all(|s| *s == seen[0]));
        seen[0]
    };
    assert_eq!(run(1), run(3));
}

#[test]
fn a_panic_stops_here_and_poisons_the_handle() {
    let mesh = computed();
    let mut e = error();
    // SAFETY: as C calls it.
    unsafe {
        assert_eq!(guard(&mut e, || panic!("no handle: {}", 1)), AR_E_INTERNAL);
        assert_eq!(message(&e), "defect in armesh: no handle: 1");
        assert_eq!(guard_handle(mesh, &mut e, |_| panic!("with a handle")), AR_E_INTERNAL);
        assert_eq!((e.status, e.first_index), (AR_E_INTERNAL, AR_NONE));
        let mut n = 3;
        assert_eq!(ar_get_vertex_d1(mesh, null_mut(), 0, &mut n, &mut e), AR_E_POISONED);
        assert_eq!((ar_compute(mesh, null(), &mut e), n), (AR_E_POISONED, 3));
        assert_eq!(ar_mesh_free(mesh), AR_OK);
    }
}

#[test]
fn a_handle_of_another_kind_is_no_mesh() {
    let mut memory = [0x5555_5555_5555_5555u64; 64];
    let fake = memory.as_mut_ptr().cast::<ar_mesh>();
    // SAFETY: the memory is ours and large enough to be looked at.
    unsafe {
        assert_eq!(ar_compute(fake, null(), null_mut()), AR_E_HANDLE);
        assert_eq!(ar_mesh_free(fake), AR_E_HANDLE);
        assert_eq!(ar_compute(fake.byte_add(1), null(), null_mut()), AR_E_HANDLE);
    }
}

#[test]
fn long_messages_are_cut_between_characters() {
    for shift in 0..4 {
        let text = "x".repeat(shift) + &"→".repeat(400);
        let mut e = error();
        // SAFETY: as C calls it.
        unsafe { guard(&mut e, || Err(Fail::new(AR_E_FORMAT, text.clone()))) };
        let got = message(&e);
        assert!(text.starts_with(&got) && got.len() > AR_MESSAGE_SIZE - 5, "{}", got.len());
        assert_eq!(e.message[AR_MESSAGE_SIZE - 1], 0);
    }
    let mut e = error();
    // SAFETY: as C calls it.
    unsafe { guard(&mut e, || Err(Fail::new(AR_E_FORMAT, "a\0b\nc"))) };
    assert_eq!(message(&e), "a b c");
    let _: c_char = e.message[0];
}

#[test]
fn files_that_are_no_meshes_are_refused() {
    let load = |path: &CStr| {
        let (mut mesh, mut e) = (null_mut(), error());
        // SAFETY: as C calls it.
        let status = unsafe { ar_mesh_load(path.as_ptr(), null(), &mut mesh, &mut e) };
        assert!(mesh.is_null());
        (name(status), message(&e))
    };
    let (code, text) = load(c"/nonexistent/part.stl");
    assert!(code == "AR_E_IO" && text.contains("part.stl"), "{code} {text}");
    assert_eq!(load(c"").0, "AR_E_IO");
    assert_eq!(load(c"/").0, "AR_E_IO");
}

#[test]
fn segments_go_out_at_the_size_of_the_callers_struct() {
    let mesh = make(&cube().desc).unwrap();
    let (mut e, mut n) = (error(), 0usize);
    // SAFETY: as C calls it; the buffers are as large as said.
    unsafe {
        assert_eq!(ar_get_face_segment(mesh, null_mut(), 0, &mut n, &mut e), AR_E_NOT_COMPUTED);
        assert!(message(&e).contains("ar_segment"));
        assert_eq!(ar_segment(mesh, null(), &mut e), AR_OK);
        let mut faces = [7u32; 12];
        assert_eq!(ar_get_face_segment(mesh, faces.as_mut_ptr(), 12, &mut n, &mut e), AR_OK);
        assert_eq!((n, faces), (12, [0; 12]));

        let mut infos = zeroed_pair();
        assert_eq!(ar_get_segments(mesh, null_mut(), 0, &mut n, &mut e), AR_OK);
        assert_eq!(n, 1);
        assert_eq!(ar_get_segments(mesh, infos.as_mut_ptr(), 2, &mut n, &mut e), AR_E_STRUCT, "not initialised");
        assert_eq!(ar_segment_info_init_sized(&mut infos[0], size_of::<ar_segment_info>() as u32), AR_OK);
        assert_eq!(ar_get_segments(mesh, infos.as_mut_ptr(), 2, &mut n, &mut e), AR_OK);
        let s = infos[0];
        assert_eq!((n, s.faces, s.flags, s.handles, s.neighbours), (1, 12, 0, 0, 0));
        assert!((s.area - 6.0).abs() < 1e-6 && (s.d2_max - 1.0).abs() < 0.02, "{s:?}");
        assert!((s.ratio_max / 5f64.sqrt() - 1.0).abs() < 0.05 && s.loop_length.is_nan(), "{s:?}");
        assert_eq!(infos[1].struct_size, 0, "beyond the count nothing is written");

        assert_eq!(ar_get_segment_neighbours(mesh, 0, null_mut(), 0, &mut n, &mut e), AR_OK);
        assert_eq!(n, 0);
        assert_eq!(ar_get_segment_neighbours(mesh, 1, null_mut(), 0, &mut n, &mut e), AR_E_ARGUMENT);
        assert_eq!(ar_mesh_free(mesh), AR_OK);
    }
}

fn zeroed_pair() -> [ar_segment_info; 2] {
    [zeroed(), zeroed()]
}

#[test]
fn segment_options_out_of_range_are_refused_and_a_refusal_leaves_the_segments() {
    let mesh = make(&cube().desc).unwrap();
    let (mut e, mut n) = (error(), 0usize);
    let options = |change: fn(&mut ar_segment_options)| {
        let mut o = zeroed::<ar_segment_options>();
        o.struct_size = size_of::<ar_segment_options>() as u32;
        change(&mut o);
        o
    };
    // SAFETY: as C calls it.
    unsafe {
        assert_eq!(ar_segment(mesh, null(), &mut e), AR_OK);
        let wrong: [fn(&mut ar_segment_options); 7] = [
            |o| o.method = 9,
            |o| o.criterion = 9,
            |o| o.count = 5000,
            |o| o.reserved = 1,
            |o| o.min_area = 0.9,
            |o| o.alpha = f64::NAN,
            |o| (o.alpha, o.beta, o.gamma) = (-1.0, -1.0, -1.0),
        ];
        for (k, change) in wrong.into_iter().enumerate() {
            assert_eq!(ar_segment(mesh, &options(change), &mut e), AR_E_ARGUMENT, "{k}");
        }
        assert_eq!(ar_segment(mesh, &options(|o| o.memory_budget = 1), &mut e), AR_E_BUDGET);
        assert_eq!(ar_segment(null_mut(), null(), &mut e), AR_E_NULL);
        assert_eq!(ar_get_face_segment(mesh, null_mut(), 0, &mut n, &mut e), AR_OK);
        for method in [AR_SEGMENT_PAPER, AR_SEGMENT_LANDMARKS] {
            let mut o = options(|o| o.count = 2);
            o.method = method;
            assert_eq!(ar_segment(mesh, &o, &mut e), AR_OK, "{}", message(&e));
        }
        assert_eq!(ar_mesh_free(mesh), AR_OK);
    }
}

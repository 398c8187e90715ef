//! Meshes that come in: by buffers and by files.

use super::*;

#[test]
fn codes_have_their_names() {
    let lines = include_str!("../status.rs").lines();
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

//! What comes out.

use super::*;

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

//! Structs of other versions, and numbers out of range.

use super::*;

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
unsafe impl crate::capi::options::CStruct for Grown {
    const NAME: &'static str = "grown";
    const MIN: usize = 8;
}

#[test]
fn a_struct_of_the_first_version_is_not_read_or_written_past_its_end() {
    let mut memory = [8u32, 5, 99, 99];
    let p = memory.as_mut_ptr().cast::<Grown>();
    // SAFETY: eight bytes belong to the struct.
    unsafe {
        let read = crate::capi::options::read(p).unwrap();
        assert_eq!(read, Grown { struct_size: 8, first: 5, second: 0 });
        crate::capi::options::write(p, Grown { struct_size: 1, first: 6, second: 7 });
        assert_eq!(memory, [8, 6, 99, 99]);
        assert_eq!(crate::capi::options::init(memory.as_mut_ptr().cast::<Grown>(), 8), AR_OK);
    }
    assert_eq!(memory, [8, 0, 99, 99]);
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

//! Progress, cancelling, budgets, threads, panics, handles, messages.

use super::*;

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

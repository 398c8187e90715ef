//! Each stage apart, on round meshes of three sizes and on a part as it comes out of CAD:
//!
//! ```sh
//! cargo bench --bench stages                                  # all of them
//! cargo bench --bench stages -- widths                        # those whose name has this in it
//! ARMESH_BENCH_PARTS=FOLDER cargo bench --bench stages        # with the STL files of a folder besides
//! ARMESH_BENCH_THREADS=1 cargo bench --bench stages           # on one thread; else one a core
//! ```
//!
//! Faces a second are printed beside each time. Instructions, which noise does not change, are counted by
//! `benches/instructions.sh`; peers are in `benches/peers`.

use armesh::error::Result;
use armesh::feature::{FeatureOptions, find_features};
use armesh::field::{Options, Profile, compute};
use armesh::geodesic::exact::{ExactGeodesics, Limits, Scratch, SurfacePoint};
use armesh::geodesic::{HeatOptions, HeatSolver, Mode};
use armesh::io::{self, RawMesh};
use armesh::job::{CancelToken, Job};
use armesh::mesh::intrinsic::IntrinsicMesh;
use armesh::mesh::simplify::{SimplifyOptions, simplify};
use armesh::mesh::surface::{AnalysisSurface, SurfaceOptions};
use armesh::mesh::{MeshOptions, TriMesh};
use armesh::segment::{SegmentOptions, segment};
use armesh::thickness::bvh::RayMesh;
use armesh::thickness::cone::{ANGLE, Cone, RAYS};
use armesh::thickness::inscribed::face_widths;
use armesh::thickness::wall::WallMesh;
use divan::Bencher;
use divan::counter::{BytesCount, ItemsCount};
use std::fmt;
use std::path::{Path, PathBuf};

fn main() {
    divan::main();
}

/// A mesh to measure on.
enum Case {
    /// A round, lumpy shape, each of the six sides of a cube around it cut into so many squares each way.
    Lumps(usize),
    /// A file.
    Part(PathBuf),
}

impl fmt::Display for Case {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Case::Lumps(n) => write!(f, "round, {} faces", 12 * n * n),
            Case::Part(path) => write!(f, "{}", path.file_stem().unwrap_or_default().to_string_lossy()),
        }
    }
}

fn all() -> Vec<Case> {
    let bracket = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/parts/bracket.stl");
    let mut cases = vec![Case::Lumps(10), Case::Lumps(29), Case::Lumps(91), Case::Part(bracket)];
    if let Some(folder) = std::env::var_os("ARMESH_BENCH_PARTS") {
        let entries = std::fs::read_dir(&folder).into_iter().flatten().flatten().map(|e| e.path());
        let mut parts: Vec<PathBuf> = entries.filter(|p| p.extension().is_some_and(|e| e == "stl")).collect();
        parts.sort();
        cases.extend(parts.into_iter().map(Case::Part));
    }
    cases
}

/// Those on which a stage takes seconds at most that grows faster than the mesh.
fn small() -> Vec<Case> {
    all().into_iter().filter(|c| !matches!(c, Case::Lumps(n) if *n > 50)).collect()
}

fn job() -> Job {
    let threads = std::env::var("ARMESH_BENCH_THREADS").ok().and_then(|t| t.parse().ok()).unwrap_or(0);
    Job::new(threads, None, CancelToken::default())
}

/// Binary STL of a round shape.
fn lumps(n: usize) -> Vec<u8> {
    let point = |side: usize, i: usize, j: usize| {
        let [u, v] = [i, j].map(|k| (std::f64::consts::FRAC_PI_4 * (2.0 * k as f64 / n as f64 - 1.0)).tan());
        let mut p = [0.0; 3];
        (p[side / 2], p[(side / 2 + 1) % 3], p[(side / 2 + 2) % 3]) = (if side % 2 == 0 { 1.0 } else { -1.0 }, u, v);
        let r = (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt();
        let p = p.map(|x| x / r);
        let lump = 1.0 + 0.05 * (5.0 * p[0]).sin() * (4.0 * p[1]).cos() * (3.0 * p[2]).sin();
        [40.0 * p[0] * lump, 25.0 * p[1] * lump, 15.0 * p[2] * lump].map(|x| ((x * 1e6).round() / 1e6) as f32)
    };
    let mut out = vec![b' '; 80];
    out.extend((12 * n as u32 * n as u32).to_le_bytes());
    for side in 0..6 {
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let [a, b, c, d] = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| point(side, i, j));
            for mut t in [[a, b, c], [a, c, d]] {
                if side % 2 == 1 {
                    t.reverse();
                }
                out.extend([0u8; 12]);
                t.iter().flatten().for_each(|x| out.extend(x.to_le_bytes()));
                out.extend([0u8; 2]);
            }
        }
    }
    out
}

fn bytes(case: &Case) -> Vec<u8> {
    match case {
        Case::Lumps(n) => lumps(*n),
        Case::Part(path) => std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display())),
    }
}

fn raw(case: &Case) -> RawMesh {
    done(io::parse(&bytes(case), "stl", &io::Limits::default(), &job()))
}

fn mesh(case: &Case) -> TriMesh {
    done(TriMesh::new(&raw(case), &MeshOptions::default(), &job()))
}

fn done<T>(result: Result<T>) -> T {
    result.unwrap_or_else(|e| panic!("{e}"))
}

/// Times `work` on a mesh, which is turned outward and has its topology.
fn on<T: Send>(bencher: Bencher, case: &Case, work: impl Fn(&TriMesh, &[[u32; 3]], &Job) -> Result<T> + Send + Sync) {
    let mesh = mesh(case);
    let triangles = done(mesh.topology()).oriented(mesh.triangles());
    let counted = bencher.counter(ItemsCount::new(triangles.len()));
    counted.bench_local(|| {
        let job = job();
        done(job.run(None, || work(&mesh, &triangles, &job)))
    });
}

#[divan::bench(args = all(), max_time = 2)]
fn a_read_stl(bencher: Bencher, case: &Case) {
    let bytes = bytes(case);
    bencher
        .counter(BytesCount::new(bytes.len()))
        .bench_local(|| io::parse(&bytes, "stl", &io::Limits::default(), &job()));
}

#[divan::bench(args = all(), max_time = 2)]
fn b_weld_and_check(bencher: Bencher, case: &Case) {
    let raw = raw(case);
    let counted = bencher.counter(ItemsCount::new(raw.triangles.len()));
    counted.bench_local(|| {
        let mesh = done(TriMesh::new(&raw, &MeshOptions::default(), &job()));
        done(mesh.topology().map(|t| t.edge_count()))
    });
}

#[divan::bench(args = all(), max_time = 3)]
fn c_ray_tree(bencher: Bencher, case: &Case) {
    on(bencher, case, |mesh, triangles, job| RayMesh::new(mesh.positions(), triangles, job));
}

#[divan::bench(args = all(), max_time = 5)]
fn d_d2_by_rays(bencher: Bencher, case: &Case) {
    let (mesh, cone) = (mesh(case), done(Cone::new(RAYS, ANGLE)));
    let triangles = done(mesh.topology()).oriented(mesh.triangles());
    let rays = done(RayMesh::new(mesh.positions(), &triangles, &job()));
    bencher.counter(ItemsCount::new(triangles.len() * RAYS)).bench_local(|| {
        let job = job();
        done(job.run(None, || face_widths(&rays, &cone, &job)))
    });
}

#[divan::bench(args = all(), max_time = 5)]
fn e_wall_widths(bencher: Bencher, case: &Case) {
    on(bencher, case, |mesh, triangles, job| {
        WallMesh::new(mesh.positions(), triangles, job)?.surface_widths(mesh.positions(), triangles, job)
    });
}

#[divan::bench(args = all(), max_time = 3)]
fn f_analysis_surface(bencher: Bencher, case: &Case) {
    on(bencher, case, |mesh, triangles, job| {
        AnalysisSurface::refine(mesh.positions(), triangles, &SurfaceOptions::default(), job)
    });
}

#[divan::bench(args = all(), max_time = 3)]
fn g_simplify_to_1000(bencher: Bencher, case: &Case) {
    let options = SimplifyOptions { target_faces: 1000, max_error: 0.1 };
    on(bencher, case, |mesh, triangles, job| simplify(mesh.positions(), triangles, &options, job));
}

#[divan::bench(args = all(), max_time = 3)]
fn h_heat_factor(bencher: Bencher, case: &Case) {
    on(bencher, case, |mesh, _, job| {
        let mut surface = IntrinsicMesh::from_extrinsic(mesh.positions(), mesh.triangles())?;
        surface.mollify(1e-6);
        HeatSolver::new(&surface, HeatOptions { time_factor: 1.0 }, job)
    });
}

#[divan::bench(args = all(), max_time = 3)]
fn i_heat_16_sources(bencher: Bencher, case: &Case) {
    let mesh = mesh(case);
    let mut surface = done(IntrinsicMesh::from_extrinsic(mesh.positions(), mesh.triangles()));
    surface.mollify(1e-6);
    let solver = done(HeatSolver::new(&surface, HeatOptions { time_factor: 1.0 }, &job()));
    let mut scratch = done(solver.scratch());
    let sources: Vec<[u32; 1]> = (0..16).map(|k| [k * (solver.vertex_count() as u32 / 16)]).collect();
    let columns: Vec<&[u32]> = sources.iter().map(|s| &s[..]).collect();
    bencher
        .counter(ItemsCount::new(16 * solver.vertex_count()))
        .bench_local(|| done(solver.solve(&columns, &mut scratch)).iter().copied().fold(0.0, f64::max));
}

#[divan::bench(args = small(), max_time = 3)]
fn j_exact_field(bencher: Bencher, case: &Case) {
    let mesh = mesh(case);
    let solver = done(ExactGeodesics::new(mesh.positions(), mesh.triangles()));
    let mut scratch = Scratch::default();
    bencher
        .counter(ItemsCount::new(mesh.triangles().len()))
        .bench_local(|| done(solver.distances(SurfacePoint::Vertex(0), &[], &Limits::default(), &mut scratch, &job())));
}

#[divan::bench(args = all(), max_time = 5)]
fn k_compute_paper(bencher: Bencher, case: &Case) {
    let options = Options { profile: Profile::Paper, d1: Mode::Certified { tolerance: 0.05 }, ..Options::default() };
    on(bencher, case, |mesh, _, job| compute(mesh, &options, job));
}

#[divan::bench(args = all(), max_time = 5)]
fn l_compute_print(bencher: Bencher, case: &Case) {
    on(bencher, case, |mesh, _, job| compute(mesh, &Options::default(), job));
}

#[divan::bench(args = all(), max_time = 5)]
fn m_segment(bencher: Bencher, case: &Case) {
    on(bencher, case, |mesh, _, job| segment(mesh, &SegmentOptions { measure: false, ..Default::default() }, job));
}

#[divan::bench(args = all(), max_time = 5)]
fn n_find_features(bencher: Bencher, case: &Case) {
    on(bencher, case, |mesh, _, job| find_features(mesh, &FeatureOptions::default(), job));
}

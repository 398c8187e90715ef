//! Where the parts are, by method: a label for every face, not yet connected or numbered.

use super::affinity::{Graph, step_weights};
use super::cut::{contract, pair};
use super::dual::Dual;
use super::finish::NEUTRAL;
use super::patches::{Border, Patches};
use super::refine::refine;
use super::spectral::{Embedding, MOST, embed_all, embed_sampled};
use super::vsi::Images;
use super::{Criterion, SegmentOptions};
use crate::error::{Error, Result, try_filled, try_vec};
use crate::job::Job;
use crate::mesh::NONE;
use crate::mesh::measure::{Vec3, add, distance, dot, norm, scale};
use crate::mesh::sets::Sets;
use crate::mesh::surface::AnalysisSurface;
use crate::thickness::bvh::RayMesh;
use crate::thickness::chords::{first_met, widths_at};
use crate::thickness::cone::{self, Cone};
use hashbrown::HashMap;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// Patches that stand for all in the embedding.
const LANDMARKS: usize = 600;
/// A ray straight into the solid crosses the wall whose width is measured there if it is not longer than this many widths.
const ACROSS: f64 = 1.25;
/// Cosine of the angle within which the far side of a wall faces away, 25 degrees.
const OPPOSED: f64 = 0.9;
/// Memory that the dense method may take when the job has no budget, bytes.
const DENSE_LIMIT: u64 = 4 << 30;

/// A surface to be partitioned, and the solid that it bounds.
pub struct Scene<'a> {
    /// The surface.
    pub dual: &'a Dual,
    /// The face of `rays` that every face of the surface lies on.
    pub parent: &'a [u32],
    /// The solid.
    pub rays: &'a RayMesh,
}

/// How much a border attracts: its length times what its turning falls short of [`NEUTRAL`].
fn pull(length: f64, concave: f64) -> f64 {
    length * (NEUTRAL - concave)
}

/// Greedy contraction is led astray by what it joins first. It is therefore begun several times, and the partition that
/// cuts best is kept: at once; and from the smooth pieces that are left when convex edges, too, repel by these shares of
/// their turn.
const STARTS: [f64; 2] = [0.5, 0.25];

/// Two patches, and how much they attract each other.
type Tie = ([u32; 2], f64);

/// --- creases: the cut that maximises the turning along its borders. With `count`, that many parts are left.
pub fn by_creases(
    scene: &Scene<'_>,
    surface: &AnalysisSurface,
    patches: &Patches,
    count: Option<usize>,
    job: &Job,
) -> Result<Vec<u32>> {
    let n = patches.seed.len();
    let over: Vec<Tie> = patches.borders.iter().map(|b| (b.patches, pull(b.length, b.concave))).collect();
    // --- smooth pieces, and what lies across walls
    let pieces = |share: f64| {
        let smooth = |b: &Border| (b.patches, pull(b.length, b.concave + share * b.convex));
        let smooth: Vec<Tie> = patches.borders.iter().map(smooth).collect();
        contract(n, &smooth, None)
    };
    let shares = [STARTS[0], STARTS[1], 1.0];
    let (across, pieces) = rayon::join(
        || across(scene, surface, patches, job),
        || shares.par_iter().map(|&share| pieces(share)).collect::<Result<Vec<_>>>(),
    );
    let ((across, width), mut pieces) = (across?, pieces?);
    let sharp = pieces.pop().unwrap_or_default();
    let mut pulls: Vec<Tie> = try_vec(over.len() + across.len(), "borders of patches")?;
    pulls.extend(over.iter().chain(&across));
    // --- the best start
    let begin = |k: usize| {
        job.check()?;
        let region = match k.checked_sub(1) {
            Some(k) => begun(&pieces[k], &pulls, count)?,
            None => contract(n, &pulls, count)?,
        };
        Ok((pulls.iter().filter(|p| parted(&region, p.0)).map(|p| p.1).sum::<f64>(), region))
    };
    let starts: Vec<(f64, Vec<u32>)> = (0..=pieces.len()).into_par_iter().map(begin).collect::<Result<_>>()?;
    // where a number is asked for, only partitions into as many are compared
    let misfit = |region: &[u32]| count.map_or(0, |k| distinct(region).abs_diff(k));
    let best = starts.into_iter().min_by(|a, b| misfit(&a.1).cmp(&misfit(&b.1)).then(a.0.total_cmp(&b.0)));
    let mut region = best.map_or(Vec::new(), |b| b.1);
    if count.is_none() {
        bettered(&sharp, &pulls, &across, &mut region, job)?;
        let measured = (&width[..], &patches.area[..]);
        let before = region;
        region = reunited(&before, &over, &across, measured)?;
        // what is parted now is not held together across any more, and borders may be better elsewhere
        let ties: Vec<Tie> = over.iter().chain(across.iter().filter(|t| !parted(&region, t.0))).copied().collect();
        let apart = settled(&before, &region, &over, measured)?;
        refine(n, &ties, &[], &apart, &mut region, job)?;
    }
    Ok(patches.of_face.iter().map(|&p| region[p as usize]).collect())
}

fn parted(region: &[u32], [p, q]: [u32; 2]) -> bool {
    region[p as usize] != region[q as usize]
}

/// The contraction, started from pieces.
fn begun(piece: &[u32], pulls: &[Tie], count: Option<usize>) -> Result<Vec<u32>> {
    let n = piece.len();
    let between = pulls.iter().filter(|p| parted(piece, p.0)).map(|&(p, w)| (p.map(|v| piece[v as usize]), w));
    let between: Vec<Tie> = between.collect();
    // patches that stand for no piece are nodes of the graph, too, without any border
    let region = contract(n, &between, count.map(|k| k + n - distinct(piece)))?;
    Ok(piece.iter().map(|&p| region[p as usize]).collect())
}

/// Number of different labels, which are below their count.
fn distinct(label: &[u32]) -> usize {
    let mut seen = vec![false; label.len()];
    label.iter().for_each(|&l| seen[l as usize] = true);
    seen.into_iter().filter(|s| *s).count()
}

/// A smooth piece is the side of a plate if so much of it has the same other piece across.
const PLATE: f64 = 0.7;
/// A part is looked for around smooth pieces of so many patches at least.
const LARGE: u32 = 4;

/// Two plates in an angle hang together by their rims before the crease between them counts. Therefore a cut is bettered
/// first with the sides of plates as they are: smooth pieces, parted by convex edges as much as by concave ones, with one
/// other across most of them.
///
/// `piece` are these smooth pieces by patch.
fn bettered(piece: &[u32], pulls: &[Tie], across: &[Tie], region: &mut [u32], job: &Job) -> Result<()> {
    let n = region.len();
    // --- by piece: its patches, and those that have another one across
    let mut count = try_filled(n, 0u32, "sides of plates")?;
    piece.iter().for_each(|&p| count[p as usize] += 1);
    let mut tied: Vec<[u32; 3]> = try_vec(2 * across.len(), "sides of plates")?;
    tied.extend(
        across.iter().flat_map(|&([a, b], _)| [[a, b], [b, a]].map(|[a, b]| [piece[a as usize], piece[b as usize], a])),
    );
    tied.sort_unstable();
    tied.dedup();
    let mut side = try_filled(n, false, "sides of plates")?;
    for same in tied.chunk_by(|a, b| a[..2] == b[..2]).filter(|same| same[0][0] != same[0][1]) {
        let p = same[0][0] as usize;
        side[p] |= same.len() as f64 >= PLATE * f64::from(count[p]);
    }
    let none = BTreeSet::new();
    // --- sides of plates as one node, as far as they are of one region; other patches as they are
    let mut unit: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    let node: Vec<u32> = (0..n as u32)
        .map(|v| match piece[v as usize] {
            p if side[p as usize] => *unit.entry([p, region[v as usize]]).or_insert(v),
            _ => v,
        })
        .collect();
    let between = pulls.iter().map(|&(p, w)| (p.map(|v| node[v as usize]), w)).filter(|t| t.0[0] != t.0[1]);
    let between: Vec<Tie> = between.collect();
    // --- what is parted may begin with any smooth piece
    let mut seeds: BTreeMap<[u32; 2], Vec<u32>> = BTreeMap::new();
    for v in 0..n as u32 {
        if node[v as usize] == v {
            seeds.entry([piece[v as usize], region[v as usize]]).or_default().push(v);
        }
    }
    let seeds: Vec<Vec<u32>> = seeds.into_iter().filter(|s| count[s.0[0] as usize] >= LARGE).map(|s| s.1).collect();
    refine(n, &between, &seeds, &none, region, job)?;
    (0..n).for_each(|v| region[v] = region[node[v] as usize]);
    // --- the borders between them
    refine(n, pulls, &[], &none, region, job)
}

/// How much of what holds two pieces together across a wall counts, in shares of their attraction by the borders of the
/// region between them. A floor and a bottom repel and attract the wall around them, length by length, by 1.0 and 0.55.
const HOLD: f64 = 2.0;
/// Pieces are joined around a wall only if the thinner is so many times as thick as the other, at least: a flange on a pipe
/// and the crown of a piston are no more of the wall that stands on them.
const ALIKE: f64 = 0.6;

/// The floor and the bottom of a cup are one region across the wall between them, but hang together only through the
/// wall around them. Pieces of one region are joined with a region through which they hang together if what holds them
/// across, up to [`HOLD`] times what attracts them to it, outweighs what repels them from it. A rib that stands on a
/// plate attracts nothing and stays a part. `measured` are the widths and areas of the patches.
fn reunited(region: &[u32], over: &[Tie], across: &[Tie], measured: (&[f64], &[f64])) -> Result<Vec<u32>> {
    let n = region.len();
    let within = over.iter().filter(|t| !parted(region, t.0)).map(|t| t.0);
    let piece = together(n, within)?;
    let middle = middles(&piece, measured)?;
    let alike = |pair: [u32; 2]| are_alike(&middle, pair);
    // --- by two pieces: how much they attract each other over their border; which are one across
    let mut border: BTreeMap<[u32; 2], f64> = BTreeMap::new();
    for &(patches, w) in over.iter().filter(|t| parted(region, t.0)) {
        let [p, q] = patches.map(|v| piece[v as usize]);
        *border.entry([p, q]).or_insert(0.0) += w;
        *border.entry([q, p]).or_insert(0.0) += w;
    }
    let mut held: BTreeMap<[u32; 2], f64> = BTreeMap::new();
    for &(patches, w) in across.iter().filter(|t| !parted(region, t.0)) {
        let [p, q] = patches.map(|v| piece[v as usize]);
        if p != q {
            *held.entry(pair(p, q)).or_insert(0.0) += w;
        }
    }
    // --- two pieces p and q, one across, and a piece r that both border on
    let mut joins: Vec<[u32; 2]> = Vec::new();
    for (&[p, q], &hold) in &held {
        for (&[_, r], &a) in border.range([p, 0]..=[p, u32::MAX]) {
            let Some(&b) = border.get(&[q, r]) else { continue };
            let attract = a.max(0.0) + b.max(0.0);
            let held = attract + a.min(0.0) + b.min(0.0) + hold.min(HOLD * attract) > 0.0;
            if held && alike([p, r]) && alike([q, r]) {
                joins.extend([[p, r], [q, r]]);
            }
        }
    }
    let joined = together(n, joins.into_iter())?;
    Ok(piece.iter().map(|&p| joined[p as usize]).collect())
}

/// Neighbouring regions whose border stays: both are as they were `before`, or one is much thicker than the other.
fn settled(before: &[u32], region: &[u32], over: &[Tie], measured: (&[f64], &[f64])) -> Result<BTreeSet<[u32; 2]>> {
    let middle = middles(region, measured)?;
    // --- regions that are one of several that were one
    let mut first = try_filled(region.len(), NONE, "regions")?;
    let mut several = try_filled(region.len(), false, "regions")?;
    for (&was, &is) in before.iter().zip(region) {
        let first = &mut first[was as usize];
        if *first == NONE {
            *first = is;
        } else if *first != is {
            several[was as usize] = true;
        }
    }
    let mut new = try_filled(region.len(), false, "regions")?;
    before.iter().zip(region).for_each(|(&was, &is)| new[is as usize] |= several[was as usize]);
    let stays = |pair: [u32; 2]| !pair.iter().any(|&r| new[r as usize]) || !are_alike(&middle, pair);
    let pairs = over.iter().map(|t| t.0.map(|v| region[v as usize])).map(|[a, b]| pair(a, b));
    Ok(pairs.filter(|&pair| stays(pair)).collect())
}

/// Whether two pieces are about as wide, by how wide each is in the middle; also where that of one is not known.
fn are_alike(middle: &[f64], pieces: [u32; 2]) -> bool {
    let [a, b] = pieces.map(|p| middle[p as usize]);
    !(a.min(b) < ALIKE * a.max(b))
}

/// How wide pieces are in the middle of their area, by piece; NaN where no patch of one has a width.
fn middles(piece: &[u32], (width, area): (&[f64], &[f64])) -> Result<Vec<f64>> {
    let mut whole = try_filled(piece.len(), 0.0, "widths of regions")?;
    let mut order: Vec<u32> = try_vec(piece.len(), "widths of regions")?;
    for v in (0..piece.len()).filter(|&v| width[v].is_finite()) {
        whole[piece[v] as usize] += area[v];
        order.push(v as u32);
    }
    order.sort_unstable_by(|&u, &v| width[u as usize].total_cmp(&width[v as usize]).then(u.cmp(&v)));
    let mut below = try_filled(piece.len(), 0.0, "widths of regions")?;
    let mut middle = try_filled(piece.len(), f64::NAN, "widths of regions")?;
    for v in order.into_iter().map(|v| v as usize) {
        let p = piece[v] as usize;
        below[p] += area[v];
        if middle[p].is_nan() && below[p] >= 0.5 * whole[p] {
            middle[p] = width[v];
        }
    }
    Ok(middle)
}

/// What pairs of `n` nodes join, named by one of its nodes.
fn together(n: usize, pairs: impl Iterator<Item = [u32; 2]>) -> Result<Vec<u32>> {
    let mut sets = Sets::new(n)?;
    pairs.for_each(|[a, b]| sets.join(a, b));
    let mut region = try_vec(n, "regions")?;
    region.extend((0..n as u32).map(|v| sets.root(v)));
    Ok(region)
}

/// Pairs of patches on opposite sides of one wall, which attract each other as a flat border as long as the patch is wide would:
/// the floor of a cup belongs to its bottom, the bore of a pipe to its outside. And the width at every patch.
fn across(scene: &Scene<'_>, surface: &AnalysisSurface, patches: &Patches, job: &Job) -> Result<(Vec<Tie>, Vec<f64>)> {
    let dual = scene.dual;
    let points: Vec<Vec3> = patches.seed.iter().map(|&f| dual.centroid[f as usize]).collect();
    let ways: Vec<Vec3> = patches.seed.iter().map(|&f| scale(dual.normal[f as usize], -1.0)).collect();
    let parents: Vec<u32> = patches.seed.iter().map(|&f| scene.parent[f as usize]).collect();
    let width = widths_at(scene.rays, &points, &parents, &Cone::new(cone::RAYS, cone::ANGLE)?, job)?;
    let met = first_met(scene.rays, &points, &ways, Some(&parents), job)?;
    let children = Children::new(surface, &dual.centroid, met.iter().map(|m| m.face))?;
    let opposite = |p: usize| -> Option<Tie> {
        // also false for a NaN; a longer way runs along the wall, not across it
        if !(met[p].distance <= ACROSS * width[p]) {
            return None;
        }
        let hit = add(points[p], scale(ways[p], met[p].distance));
        let g = children.nearest(met[p].face, hit)?;
        let q = patches.of_face[g as usize];
        // from the far side too: below a pin the ray runs across the plate and along the pin
        let facing = dot(dual.normal[g as usize], ways[p]) > OPPOSED && met[p].distance <= ACROSS * width[q as usize];
        (facing && q != p as u32)
            .then(|| ([p as u32, q], NEUTRAL * patches.area[p].min(patches.area[q as usize]).sqrt()))
    };
    let ties = (0..points.len()).into_par_iter().filter_map(opposite).collect();
    Ok((ties, width))
}

/// The faces that some input faces were cut into, sorted along a direction to be searched.
struct Children<'a> {
    centroid: &'a [Vec3],
    /// By input face.
    sorted: HashMap<u32, Vec<(f64, u32)>>,
}

/// Lines along which children are sorted: hardly a face lies square to it.
const ALONG: Vec3 = [0.537_721, 0.833_907, 0.124_889];

impl Children<'_> {
    fn new<'a>(
        surface: &AnalysisSurface,
        centroid: &'a [Vec3],
        wanted: impl Iterator<Item = u32>,
    ) -> Result<Children<'a>> {
        let mut faces: Vec<u32> = wanted.filter(|&f| f != NONE).collect();
        faces.sort_unstable();
        faces.dedup();
        let sort = |&f: &u32| {
            let mut all: Vec<(f64, u32)> = try_vec(surface.children(f as usize).len(), "children")?;
            all.extend(surface.children(f as usize).map(|c| (dot(centroid[c], ALONG) / norm(ALONG), c as u32)));
            all.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            Ok((f, all))
        };
        let sorted: Vec<(u32, Vec<(f64, u32)>)> = faces.par_iter().map(sort).collect::<Result<_>>()?;
        Ok(Children { centroid, sorted: sorted.into_iter().collect() })
    }

    /// The child of `face` whose centroid is nearest to `p`, the lowest of equals.
    fn nearest(&self, face: u32, p: Vec3) -> Option<u32> {
        let all = self.sorted.get(&face)?;
        let at = dot(p, ALONG) / norm(ALONG);
        let middle = all.partition_point(|c| c.0 < at);
        let mut best = (f64::INFINITY, NONE);
        let mut look = |c: &(f64, u32)| {
            // farther along the line than the best is away: so are all beyond
            let go_on = (c.0 - at).abs() <= best.0 * (1.0 + 1e-9);
            let gap = distance(self.centroid[c.1 as usize], p);
            if gap < best.0 || (gap == best.0 && c.1 < best.1) {
                best = (gap, c.1);
            }
            go_on
        };
        let _ = all[middle..].iter().all(&mut look);
        let _ = all[..middle].iter().rev().all(&mut look);
        (best.1 != NONE).then_some(best.1)
    }
}

/// --- the paper's method on every face (Eqs. 14-23).
pub fn by_all_faces(scene: &Scene<'_>, options: &SegmentOptions, job: &Job) -> Result<Vec<u32>> {
    let n = scene.dual.face_count();
    let bytes = (n as u64).saturating_mul(n as u64).saturating_mul(8).saturating_add(n as u64 * 4000);
    job.afford(bytes, "the paper's segmentation, which holds the distances between all pairs of faces,")?;
    if bytes > DENSE_LIMIT {
        return Err(Error::Budget(format!(
            "the paper's segmentation holds the distances between all pairs of faces: {n} faces need {bytes} bytes, \
             the limit is {DENSE_LIMIT} bytes; use another method"
        )));
    }
    let all: Vec<u32> = (0..n as u32).collect();
    let images = images(scene, &all, options, job)?;
    let steps = &scene.dual.steps;
    let volumetric: Vec<f64> =
        steps.par_iter().map(|s| images.distance(s.faces[0] as usize, s.faces[1] as usize)).collect();
    let geodesic: Vec<f64> = steps.iter().map(|s| s.geodesic).collect();
    let angular: Vec<f64> = steps.iter().map(|s| s.angular(options.shares.epsilon)).collect();
    let weights = step_weights(&geodesic, &angular, &volumetric, &options.shares);
    let edges: Vec<([u32; 2], f64)> = steps.iter().zip(weights).map(|(s, w)| (s.faces, w)).collect();
    let graph = Graph::new(n, &edges)?;
    drop(edges);
    let embedding = embed_all(&graph, wanted(options, n), job)?;
    let pulls: Vec<([u32; 2], f64)> = steps.iter().map(|s| (s.faces, pull(s.length, s.turn.max(0.0)))).collect();
    choose(&embedding, &pulls, options, job)
}

/// --- the same on patches, from landmarks.
pub fn by_landmarks(scene: &Scene<'_>, patches: &Patches, options: &SegmentOptions, job: &Job) -> Result<Vec<u32>> {
    let images = images(scene, &patches.seed, options, job)?;
    let term = |f: &dyn Fn(&Border) -> f64| -> Vec<f64> { patches.borders.iter().map(f).collect() };
    let volumetric = term(&|b| images.distance(b.patches[0] as usize, b.patches[1] as usize));
    let angular = term(&|b| b.concave + options.shares.epsilon * b.convex);
    let weights = step_weights(&term(&|b| b.geodesic), &angular, &volumetric, &options.shares);
    let edges: Vec<([u32; 2], f64)> = patches.borders.iter().zip(weights).map(|(b, w)| (b.patches, w)).collect();
    let graph = Graph::new(patches.seed.len(), &edges)?;
    let landmarks = patches.spread(LANDMARKS)?;
    let embedding = embed_sampled(&graph, landmarks, &patches.area, wanted(options, patches.seed.len()), job)?;
    let pulls: Vec<([u32; 2], f64)> = patches.borders.iter().map(|b| (b.patches, pull(b.length, b.concave))).collect();
    let label = choose(&embedding, &pulls, options, job)?;
    Ok(patches.of_face.iter().map(|&p| label[p as usize]).collect())
}

/// Number of eigenvectors to compute.
fn wanted(options: &SegmentOptions, nodes: usize) -> usize {
    options.count.map_or(MOST + 1, |k| k as usize).min(nodes)
}

/// The clustering into the wanted number of parts or, without one, the number that the criterion likes best.
fn choose(embedding: &Embedding, pulls: &[([u32; 2], f64)], options: &SegmentOptions, job: &Job) -> Result<Vec<u32>> {
    if let Some(k) = options.count {
        return embedding.cluster(k as usize, job);
    }
    if options.criterion == Criterion::Eigengap {
        return embedding.cluster(embedding.eigengap(), job);
    }
    let mut best: Option<(f64, Vec<u32>)> = None;
    for k in 1..=MOST.min(embedding.samples.len().max(1)) {
        let label = embedding.cluster(k, job)?;
        let score = match options.criterion {
            Criterion::Silhouette => embedding.silhouette(&label, k),
            // what the borders between different labels repel
            _ => -pulls.iter().filter(|p| label[p.0[0] as usize] != label[p.0[1] as usize]).map(|p| p.1).sum::<f64>(),
        };
        if best.as_ref().is_none_or(|b| score > b.0) {
            best = Some((score, label));
        }
    }
    Ok(best.map_or(Vec::new(), |b| b.1))
}

/// Shape images of some faces, from the centres of their inscribed spheres.
fn images(scene: &Scene<'_>, faces: &[u32], options: &SegmentOptions, job: &Job) -> Result<Images> {
    let pick = |from: &[Vec3]| -> Result<Vec<Vec3>> {
        let mut to = try_vec(faces.len(), "shape images")?;
        to.extend(faces.iter().map(|&f| from[f as usize]));
        Ok(to)
    };
    let (centroid, normal) = (pick(&scene.dual.centroid)?, pick(&scene.dual.normal)?);
    let parent: Vec<u32> = faces.iter().map(|&f| scene.parent[f as usize]).collect();
    let cone = Cone::new(options.rays, options.cone_angle)?;
    let width = widths_at(scene.rays, &centroid, &parent, &cone, job)?;
    Images::new(scene.rays, &centroid, &normal, &width, job)
}

//! Limbs that no crease parts from their body: on a shape that is smooth everywhere.
//!
//! A strut that grows out of a block, and the struts of a lattice with rounded nodes, are as wide as they are all along,
//! and their ends widen into something thicker or meet others. They are what stays the same when a threshold on the
//! width rises (maximally stable extremal regions, Matas, Chum, Urban & Pajdla 2002, of the width over the surface): the
//! connected places that are no wider than the threshold, and whose far side is across their own width, hardly grow while
//! it rises by a third. Where two struts meet, or a surface is the rim of a plate or the end of a bar, a line straight
//! into the solid is longer than the part is wide there: such places belong to no limb, and go with what is around them.

use super::widths::Place;
use crate::error::{Result, try_filled, try_push, try_vec};
use crate::mesh::NONE;
use crate::mesh::measure::distance;
use crate::mesh::sets::Sets;
use crate::segment::dual::Dual;
use std::collections::{BTreeMap, VecDeque};

/// The far side is across if the way straight through is no longer than this many widths.
const ACROSS: f64 = 1.08;
/// The threshold rises by this factor, ...
const STEP: f64 = 1.08;
/// ... and over so many steps a limb must last, ...
const AHEAD: usize = 4;
/// ... growing in area by no more than this factor.
const GROWTH: f64 = 1.6;
/// A limb is so many times as large as its width squared, at least: a bar 2.2 widths long.
const LARGE: f64 = 7.0;
/// A body is so many times as wide as its limbs, over an area as large as the limb's width squared.
const THICK: f64 = 1.25;
/// It has the places of so many faces, at least: where faces are larger, creases tell what is what.
const MANY: usize = 32;
/// So much of the area of a limb has its far side on the limb, too.
const OWN: f64 = 0.7;
/// Edges that turn more than this are sharp (radians): the cut along creases has judged them.
const SHARP: f64 = 0.8;
/// No more of the border of a limb is sharp than this share, ...
const SMOOTH: f64 = 0.25;
/// ... and the sharp convex edges of what is smooth everywhere are no longer than this share of its area over its width: the
/// four edges along a square bar would be 1.
const EDGED: f64 = 0.1;
/// Of a whole part: one with more has been designed with edges, and is told apart by them.
const EDGED_PART: f64 = 0.07;

/// Labels with limbs told apart from bodies and from each other: new ones after the old. `places` as measured on these
/// faces. What is smaller than `min_area` stays with its neighbour.
///
/// # Errors
/// [`crate::error::Error::NoMemory`].
pub fn at_ends(dual: &Dual, label: &[u32], places: &[Place], min_area: f64) -> Result<Vec<u32>> {
    let nodes = Nodes::new(dual, label, places)?;
    let mut limbs = stable(&nodes)?;
    limbs.keep_smooth(dual, &nodes);
    let mut out = try_vec(label.len(), "limbs")?;
    if limbs.width.is_empty() {
        out.extend_from_slice(label);
        return Ok(out);
    }
    let group = grouped(dual, &nodes, &limbs, min_area)?;
    // --- of the groups of a label the largest keeps it
    let mut area: BTreeMap<[u32; 2], f64> = BTreeMap::new();
    for (k, &g) in group.iter().enumerate() {
        *area.entry([nodes.label[k], g]).or_insert(0.0) += nodes.area[k];
    }
    let mut largest: BTreeMap<u32, (f64, u32)> = BTreeMap::new();
    for (&[l, g], &a) in &area {
        let most = largest.entry(l).or_insert((a, g));
        if a > most.0 {
            *most = (a, g);
        }
    }
    let next = label.iter().map(|l| l + 1).max().unwrap_or(0);
    let smaller = area.keys().filter(|k| largest[&k[0]].1 != k[1]).map(|k| k[1]);
    let new: BTreeMap<u32, u32> = smaller.zip(next..).collect();
    out.extend(label.iter().zip(&nodes.of_face).map(|(&l, &k)| match group.get(k as usize) {
        Some(g) => new.get(g).copied().unwrap_or(l),
        None => l,
    }));
    Ok(out)
}

/// Faces where the width is known, each with the faces without around it.
struct Nodes {
    /// By face; [`NONE`] where no place can be reached within the label.
    of_face: Vec<u32>,
    label: Vec<u32>,
    area: Vec<f64>,
    /// Infinite where the far side is not across.
    width: Vec<f64>,
    /// Pairs that border on each other or lie across from each other, by label.
    ties: Vec<[u32; 2]>,
    /// By place that has its far side across: that of the place, that of the far side (or [`NONE`]), and its area.
    far: Vec<([u32; 2], f64)>,
}

impl Nodes {
    fn new(dual: &Dual, label: &[u32], places: &[Place]) -> Result<Nodes> {
        // --- by face: area of the places that have their far side across, that times their widths, area of the others
        let mut sums: BTreeMap<u32, [f64; 3]> = BTreeMap::new();
        for p in places.iter().filter(|p| p.width.is_finite()) {
            let s = sums.entry(p.face).or_default();
            if p.facing != NONE && distance(p.at, p.across) <= ACROSS * p.width {
                (s[0], s[1]) = (s[0] + p.area, s[1] + p.area * p.width);
            } else {
                s[2] += p.area;
            }
        }
        let mut of_face = try_filled(label.len(), NONE, "places of limbs")?;
        let mut nodes = Nodes {
            of_face: Vec::new(),
            label: try_vec(sums.len(), "places of limbs")?,
            area: try_filled(sums.len(), 0.0, "places of limbs")?,
            width: try_vec(sums.len(), "places of limbs")?,
            ties: Vec::new(),
            far: Vec::new(),
        };
        let mut front: VecDeque<u32> = VecDeque::new();
        for (k, (&f, s)) in sums.iter().enumerate() {
            of_face[f as usize] = k as u32;
            nodes.label.push(label[f as usize]);
            nodes.width.push(if s[0] >= s[2] { s[1] / s[0] } else { f64::INFINITY });
            front.push_back(f);
        }
        // --- faces without places go to the nearest that has one
        while let Some(f) = front.pop_front() {
            for &(g, _) in dual.around(f) {
                if of_face[g as usize] == NONE && label[g as usize] == label[f as usize] {
                    of_face[g as usize] = of_face[f as usize];
                    front.push_back(g);
                }
            }
        }
        for (f, &k) in of_face.iter().enumerate().filter(|(_, k)| **k != NONE) {
            nodes.area[k as usize] += dual.area[f];
        }
        nodes.of_face = of_face;
        nodes.tie(dual, places)?;
        nodes.smooth()?;
        nodes.smooth()?;
        Ok(nodes)
    }

    fn tie(&mut self, dual: &Dual, places: &[Place]) -> Result<()> {
        let node = |f: u32| if f == NONE { NONE } else { self.of_face[f as usize] };
        let beside = dual.steps.iter().map(|s| s.faces.map(node));
        let across = places.iter().filter(|p| distance(p.at, p.across) <= ACROSS * p.width);
        let mut far = try_vec(places.len(), "places of limbs")?;
        far.extend(across.map(|p| ([p.face, p.facing].map(node), p.area)));
        let mut ties: Vec<[u32; 2]> = Vec::new();
        for [a, b] in beside.chain(far.iter().map(|f| f.0)).filter(|t| t[0] != t[1] && !t.contains(&NONE)) {
            if self.label[a as usize] == self.label[b as usize] {
                try_push(&mut ties, [a.min(b), a.max(b)], "places of limbs")?;
            }
        }
        ties.sort_unstable();
        ties.dedup();
        (self.ties, self.far) = (ties, far);
        Ok(())
    }

    /// The length of sharp convex edges, times the mean width and by the area: by label, and of all.
    fn edged(&self, dual: &Dual) -> (BTreeMap<u32, f64>, f64) {
        // area, area measured, that times the widths, length of edges
        let mut sums: BTreeMap<u32, [f64; 4]> = BTreeMap::new();
        for (v, label) in self.label.iter().enumerate() {
            let s = sums.entry(*label).or_default();
            s[0] += self.area[v];
            if self.width[v].is_finite() {
                (s[1], s[2]) = (s[1] + self.area[v], s[2] + self.area[v] * self.width[v]);
            }
        }
        for step in dual.steps.iter().filter(|s| s.turn < -SHARP) {
            let [a, b] = step.faces.map(|f| self.of_face.get(f as usize).and_then(|v| self.label.get(*v as usize)));
            if let (Some(a), true) = (a, a == b) {
                sums.entry(*a).or_default()[3] += step.length;
            }
        }
        let share = |[area, measured, width, length]: [f64; 4]| length * (width / measured) / area;
        let all = sums.values().fold([0.0; 4], |all, s| [0, 1, 2, 3].map(|k| all[k] + s[k]));
        (sums.into_iter().map(|(l, s)| (l, share(s))).collect(), share(all))
    }

    /// Every width becomes the middle one of its own and its neighbours'.
    fn smooth(&mut self) -> Result<()> {
        let mut around: Vec<Vec<f64>> = try_filled(self.width.len(), Vec::new(), "places of limbs")?;
        for (own, &w) in around.iter_mut().zip(&self.width) {
            own.push(w);
        }
        for &[a, b] in &self.ties {
            around[a as usize].push(self.width[b as usize]);
            around[b as usize].push(self.width[a as usize]);
        }
        for (w, all) in self.width.iter_mut().zip(&mut around) {
            all.sort_unstable_by(f64::total_cmp);
            *w = all[all.len() / 2];
        }
        Ok(())
    }
}

/// Limbs found: by node which one, and their widths.
struct Limbs {
    of_node: Vec<u32>,
    width: Vec<f64>,
}

impl Limbs {
    /// Leaves out what does not have most of its far side on itself, and what is of a label with sharp edges.
    fn keep_smooth(&mut self, dual: &Dual, nodes: &Nodes) {
        let of = |limbs: &Limbs, v: u32| limbs.of_node.get(v as usize).copied().unwrap_or(NONE);
        // by limb: area of its far side on itself and of all
        let mut sums = vec![[0.0; 2]; self.width.len()];
        for &([from, to], area) in &nodes.far {
            let limb = of(self, from);
            if let Some(s) = sums.get_mut(limb as usize) {
                s[0] += if of(self, to) == limb { area } else { 0.0 };
                s[1] += area;
            }
        }
        let (edged, all) = nodes.edged(dual);
        let machined = all > EDGED_PART;
        for (v, limb) in self.of_node.iter_mut().enumerate() {
            let closed = sums.get(*limb as usize).is_some_and(|s| s[0] >= OWN * s[1]);
            if machined || !closed || edged.get(&nodes.label[v]).is_some_and(|e| *e > EDGED) {
                *limb = NONE;
            }
        }
    }
}

/// --- the connected places below a threshold that hardly grow while it rises
fn stable(nodes: &Nodes) -> Result<Limbs> {
    let n = nodes.width.len();
    let mut limbs = Limbs { of_node: try_filled(n, NONE, "limbs")?, width: Vec::new() };
    let finite = || nodes.width.iter().copied().filter(|w| w.is_finite());
    let (low, high) = (finite().fold(f64::INFINITY, f64::min), finite().fold(0.0, f64::max));
    if !(low > 0.0 && high.is_finite()) {
        return Ok(limbs);
    }
    let levels = ((high / low).ln() / STEP.ln()).ceil() as usize + 1;
    let mut sets = Sets::new(n)?;
    let mut waiting = try_vec(nodes.ties.len(), "limbs")?;
    waiting.extend_from_slice(&nodes.ties);
    // by level that was passed, the last AHEAD of them: its threshold, and by node what stands for its region
    let mut passed: VecDeque<(f64, Vec<u32>)> = VecDeque::new();
    for k in 0..levels + AHEAD {
        let level = low * STEP.powi(k as i32 + 1);
        waiting.retain(|&[a, b]| {
            let below = nodes.width[a as usize].max(nodes.width[b as usize]) <= level;
            if below {
                sets.join(a, b);
            }
            !below
        });
        let mut region = try_vec(n, "limbs")?;
        region.extend((0..n as u32).map(|v| if nodes.width[v as usize] <= level { sets.root(v) } else { NONE }));
        passed.push_back((level, region));
        if passed.len() > AHEAD {
            let Some((width, before)) = passed.pop_front() else { break };
            let Some((_, now)) = passed.back() else { break };
            take(nodes, width, (&before, now), &mut limbs)?;
        }
    }
    Ok(limbs)
}

/// Takes the regions at one threshold that are limbs, unless a part of one was taken before.
fn take(nodes: &Nodes, width: f64, (before, now): (&[u32], &[u32]), limbs: &mut Limbs) -> Result<()> {
    let n = before.len();
    let mut sizes = try_filled(n, (0.0, 0.0), "limbs")?;
    let mut count = try_filled(n, 0usize, "limbs")?;
    let mut free = try_filled(n, true, "limbs")?;
    for v in 0..n {
        if before[v] != NONE {
            sizes[before[v] as usize].0 += nodes.area[v];
            count[before[v] as usize] += 1;
            free[before[v] as usize] &= limbs.of_node[v] == NONE;
        }
        if now[v] != NONE {
            sizes[now[v] as usize].1 += nodes.area[v];
        }
    }
    let mut number: BTreeMap<u32, u32> = BTreeMap::new();
    for v in 0..n {
        let r = before[v];
        if r == NONE || !free[r as usize] || count[r as usize] < MANY {
            continue;
        }
        let size = sizes[r as usize].0;
        if size >= LARGE * width * width && sizes[now[v] as usize].1 <= GROWTH * size {
            let next = limbs.width.len() as u32;
            let k = *number.entry(r).or_insert(next);
            if k == next {
                try_push(&mut limbs.width, width, "limbs")?;
            }
            limbs.of_node[v] = k;
        }
    }
    Ok(())
}

/// What two groups have in common.
#[derive(Default, Clone, Copy)]
struct Border {
    length: f64,
    sharp: f64,
}

/// By node what it belongs to: a limb with what only caps it, a body, or what is between limbs.
fn grouped(dual: &Dual, nodes: &Nodes, limbs: &Limbs, min_area: f64) -> Result<Vec<u32>> {
    let n = nodes.width.len();
    // --- limbs, and connected pieces of the rest; both named by one of their nodes
    let mut sets = Sets::new(n)?;
    let mut first = try_filled(limbs.width.len(), NONE, "limbs")?;
    for v in (0..n as u32).filter(|&v| limbs.of_node[v as usize] != NONE) {
        let f = &mut first[limbs.of_node[v as usize] as usize];
        *f = (*f).min(v);
        sets.join(*f, v);
    }
    let node = |f: u32| nodes.of_face[f as usize];
    let within = |[a, b]: [u32; 2]| ![a, b].contains(&NONE) && nodes.label[a as usize] == nodes.label[b as usize];
    for [a, b] in dual.steps.iter().map(|s| s.faces.map(node)).filter(|&t| within(t)) {
        if [a, b].iter().all(|&v| limbs.of_node[v as usize] == NONE) {
            sets.join(a, b);
        }
    }
    let name: Vec<u32> = (0..n as u32).map(|v| sets.root(v)).collect();
    // --- their borders
    let mut borders: BTreeMap<[u32; 2], Border> = BTreeMap::new();
    for step in &dual.steps {
        let [a, b] = step.faces.map(node);
        if within([a, b]) && name[a as usize] != name[b as usize] {
            for pair in [[a, b], [b, a]] {
                let border = borders.entry(pair.map(|v| name[v as usize])).or_default();
                border.length += step.length;
                border.sharp += if step.turn.abs() > SHARP { step.length } else { 0.0 };
            }
        }
    }
    let around = |p: u32| borders.range([p, 0]..=[p, u32::MAX]).map(|(k, b)| (k[1], *b));
    let longest = |p: u32| around(p).fold((NONE, 0.0), |m, (q, b)| if b.length > m.1 { (q, b.length) } else { m }).0;
    let width_of = |p: u32| limbs.width[limbs.of_node[p as usize] as usize];
    // --- pieces that are no body and part no limbs from each other go with the limb that they border on most
    let mut members: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    (0..n as u32).for_each(|v| members.entry(name[v as usize]).or_default().push(v));
    let is_limb = |p: u32| limbs.of_node[p as usize] != NONE;
    let mut joins: Vec<[u32; 2]> = Vec::new();
    for (&p, members) in members.iter().filter(|m| !is_limb(*m.0)) {
        let beside: Vec<u32> = around(p).map(|(q, _)| q).filter(|&q| is_limb(q)).collect();
        let width = beside.iter().fold(0.0f64, |w, &q| w.max(width_of(q)));
        let area = |v: &u32| nodes.area[*v as usize];
        let thick = |v: &&u32| (THICK * width..f64::INFINITY).contains(&nodes.width[**v as usize]);
        let body = members.iter().filter(thick).map(area).sum::<f64>() >= width * width;
        let knot = beside.len() > 1 && members.iter().map(area).sum::<f64>() >= width * width;
        if !beside.is_empty() && !((body || knot) && members.iter().map(area).sum::<f64>() >= min_area) {
            joins.push([p, longest(p)]);
        }
    }
    // --- and what hangs together with no limb was one with the rest of its label before
    let mut loose: BTreeMap<u32, u32> = BTreeMap::new();
    for &p in members.keys().filter(|&&p| !is_limb(p)) {
        if around(p).all(|(q, _)| !is_limb(q)) {
            joins.push([p, *loose.entry(nodes.label[p as usize]).or_insert(p)]);
        }
    }
    joins.iter().for_each(|&[a, b]| sets.join(a, b));
    // --- limbs that end at creases are not told apart here
    let mut sharp: Vec<[u32; 2]> = Vec::new();
    for p in first.into_iter().filter(|&p| p != NONE) {
        let mut whole = Border::default();
        let mut most = (NONE, 0.0);
        for (q, b) in around(p).collect::<Vec<_>>().into_iter().filter(|(q, _)| sets.root(*q) != sets.root(p)) {
            (whole.length, whole.sharp) = (whole.length + b.length, whole.sharp + b.sharp);
            most = if b.length > most.1 { (q, b.length) } else { most };
        }
        if whole.sharp > SMOOTH * whole.length {
            sharp.push([p, most.0]);
        }
    }
    sharp.iter().for_each(|&[a, b]| sets.join(a, b));
    Ok((0..n as u32).map(|v| sets.root(v)).collect())
}

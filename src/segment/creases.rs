//! Creases that are rounded: a fillet turns as much as the sharp edge that it replaces, in many small steps.
//!
//! From the middle of every edge that does not turn by a right angle at once, a straight line is walked over the surface to
//! both sides, and what it turns on its way is added up. A fillet, or a chamfer, turns within a short stretch and is flat
//! beyond; a bore turns on and on, and is no crease. The whole turn of a fillet is given to the edge in its middle, and
//! none to the others, so that there is one place to cut.

use super::dual::Dual;
use crate::error::{Result, try_filled};
use crate::job::Job;
use crate::mesh::measure::{Vec3, add, cross, dot, norm, scale, sub};
use crate::mesh::{NONE, Topology};
use rayon::prelude::*;

/// Turns below this are flat (radians).
const FLAT: f64 = 0.01;
/// Turns above this, 57 degrees, are edges by themselves: they are not added to, and no walk crosses them.
const SHARP: f64 = 1.0;
/// From this turn on, 30 degrees, an edge belongs to a fillet or chamfer only if it is nearly parallel to the others: other
/// edges come near each other where features meet.
const COARSE: f64 = 0.52;
/// Least cosine of the angle between a walk and the normal of a coarse edge.
const PARALLEL: f64 = 0.95;
/// Which of two equal edges in the middle counts is decided by this direction.
const GENERIC: Vec3 = [0.537_721, 0.833_907, 0.124_889];
/// Turns below this that belong to no fillet count as flat.
const ROUGH: f64 = 0.12;
/// Share of a fillet's turn that may go the other way or lie beyond its ends.
const STRAY: f64 = 0.25;
/// A concave edge is the bottom of a pleat, and counts as flat, if within twice the reach on both sides of it there is a
/// convex edge nearly parallel to it that turns by this share of its turn: a twisted wall in coarse triangles is pleated.
const PLEAT: f64 = 0.5;
/// Edges crossed by one walk.
const CROSSINGS: usize = 200;

/// The surface that is walked on.
pub struct Walker<'a> {
    /// Vertices.
    pub positions: &'a [Vec3],
    /// Faces, consistently oriented.
    pub triangles: &'a [[u32; 3]],
    /// Their edges.
    pub topology: &'a Topology,
}

/// Gives the step in the middle of every fillet that turns within `reach` (model units) of it the turn of the whole
/// fillet, the other steps of the fillet none, and steps that turn little and belong to no fillet none either.
///
/// # Errors
/// [`crate::error::Error::NoMemory`], [`crate::error::Error::Cancelled`].
pub fn gather(dual: &mut Dual, walker: &Walker<'_>, reach: f64, job: &Job) -> Result<()> {
    let mut turn_of_edge = try_filled(walker.topology.edge_count(), 0.0f64, "turns")?;
    let mut pairs: Vec<(u32, u32)> = Vec::new();
    let mut s = 0;
    for e in 0..walker.topology.edge_count() as u32 {
        let sides = walker.topology.halfedges(e).len();
        if sides == 2 {
            turn_of_edge[e as usize] = dual.steps[s].turn;
            if dual.steps[s].turn > FLAT && dual.steps[s].turn < SHARP {
                pairs.push((e, s as u32));
            }
            s += 1;
        } else {
            s += super::dual::step_count(sides);
        }
    }
    let inward = walker.inwards()?;
    let plan = Plan { walker, inward: &inward, turn_of_edge: &turn_of_edge };
    let gathered: Vec<Option<f64>> = pairs
        .par_iter()
        .map(|&(e, _)| {
            job.check()?;
            let own = turn_of_edge[e as usize];
            let walks = [0, 1].map(|k| plan.walk(walker.topology.halfedges(e)[k], reach));
            let whole = own + walks[0].near + walks[1].near;
            // the edge where half of the turning is done; where that is between two, one of them
            let lean = walks[0].near - walks[1].near;
            let tie = (lean.abs() - own).abs() <= 1e-3 * own;
            let towards = walks[usize::from(lean < 0.0)].way;
            let middle = if tie { dot(towards, GENERIC) > 0.0 } else { lean.abs() < own };
            // a fillet turns one way only, and ends: rough surfaces and bores do not
            let back = walks[0].back + walks[1].back;
            let beyond = walks[0].beyond + walks[1].beyond;
            let fillet = back <= STRAY * whole && beyond <= STRAY * whole && whole > own * (1.0 + 1e-6);
            let pleat = walks[0].ridge.min(walks[1].ridge) >= PLEAT * own;
            Ok(if fillet { Some(if middle { whole } else { 0.0 }) } else { pleat.then_some(0.0) })
        })
        .collect::<Result<_>>()?;
    for ((_, s), whole) in pairs.iter().zip(gathered) {
        let turn = &mut dual.steps[*s as usize].turn;
        // what is not part of a fillet and turns little is roughness
        *turn = whole.unwrap_or(if *turn < ROUGH { 0.0 } else { *turn });
    }
    Ok(())
}

/// What a straight line turns on its way.
#[derive(Debug, Clone, Copy, Default)]
struct Walk {
    /// Within the reach, concave minus convex.
    near: f64,
    /// Convex, within the reach.
    back: f64,
    /// Of the sharpest convex edge within twice the reach that is nearly square to the walk.
    ridge: f64,
    /// Concave, from there to twice the reach.
    beyond: f64,
    /// Unit vector in which it sets out.
    way: Vec3,
}

/// Where a line leaves a face.
struct Exit {
    halfedge: u32,
    /// Unit vector square to it, into the face that is left.
    inward: Vec3,
    point: Vec3,
    /// Length of the line within the face.
    length: f64,
}

impl Walker<'_> {
    fn ends(&self, h: u32) -> (Vec3, Vec3) {
        let t = self.triangles[h as usize / 3];
        let k = h as usize % 3;
        (self.positions[t[k] as usize], self.positions[t[(k + 1) % 3] as usize])
    }

    /// Unit vector square to the half-edge in the plane of its face, into the face; zero where
    /// there is none.
    fn inward(&self, h: u32) -> Vec3 {
        let (a, b) = self.ends(h);
        let t = self.triangles[h as usize / 3];
        let c = self.positions[t[(h as usize % 3 + 2) % 3] as usize];
        let e = sub(b, a);
        let n = cross(e, sub(c, a));
        let v = cross(n, e);
        let length = norm(v);
        if length > 0.0 { scale(v, 1.0 / length) } else { [0.0; 3] }
    }

    /// [`Walker::inward`] of every half-edge.
    fn inwards(&self) -> Result<Vec<Vec3>> {
        let mut all = try_filled(3 * self.triangles.len(), [0.0; 3], "turns")?;
        all.par_iter_mut().with_min_len(4096).enumerate().for_each(|(h, n)| *n = self.inward(h as u32));
        Ok(all)
    }
}

/// What walks have in common.
struct Plan<'a> {
    walker: &'a Walker<'a>,
    /// See [`Walker::inwards`].
    inward: &'a [Vec3],
    turn_of_edge: &'a [f64],
}

impl Plan<'_> {
    /// What a straight line turns that starts in the middle of `halfedge`, square to it, and goes into its face.
    fn walk(&self, halfedge: u32, reach: f64) -> Walk {
        let mut h = halfedge;
        let (a, b) = self.walker.ends(h);
        let mut at = scale(add(a, b), 0.5);
        let Some(mut way) = self.inward(h) else { return Walk::default() };
        let (mut sum, mut walked) = (Walk { way, ..Walk::default() }, 0.0);
        for _ in 0..CROSSINGS {
            let Some(Exit { halfedge: exit, inward: out, point, length }) = self.leave(h, at, way) else { break };
            walked += length;
            if walked > 2.0 * reach {
                break;
            }
            let topology = self.walker.topology;
            let twin = topology.twin(exit);
            let turn = self.turn_of_edge[topology.edge_of_halfedge[exit as usize] as usize];
            if twin == NONE || turn >= SHARP {
                break;
            }
            let Some(into) = self.inward(twin) else { break };
            // the line keeps its angle with the edge
            let (p, q) = self.walker.ends(exit);
            let along = sub(q, p);
            let along = scale(along, 1.0 / norm(along).max(f64::MIN_POSITIVE));
            // only as much of the turn as the line runs square to the edge
            let square = (-dot(way, out)).clamp(0.0, 1.0);
            if square >= PARALLEL {
                sum.ridge = sum.ridge.max(-turn);
            }
            if turn <= -SHARP || (turn.abs() >= COARSE && square < PARALLEL) {
                break;
            }
            if walked <= reach {
                sum.near += square * turn;
                sum.back += square * (-turn).max(0.0);
            } else {
                sum.beyond += square * turn.max(0.0);
            }
            way = add(scale(along, dot(way, along)), scale(into, square));
            (h, at) = (twin, point);
        }
        sum
    }

    /// See [`Walker::inwards`].
    fn inward(&self, h: u32) -> Option<Vec3> {
        Some(self.inward[h as usize]).filter(|n| *n != [0.0; 3])
    }

    /// Where the line from `at` on half-edge `h` in direction `way` leaves the face of `h`.
    fn leave(&self, h: u32, at: Vec3, way: Vec3) -> Option<Exit> {
        let f = h - h % 3;
        let mut best: Option<Exit> = None;
        for g in [f + (h + 1) % 3, f + (h + 2) % 3] {
            let inward = self.inward(g)?;
            let speed = -dot(way, inward);
            let distance = dot(sub(at, self.walker.ends(g).0), inward);
            if speed > 0.0 {
                let length = (distance / speed).max(0.0);
                if best.as_ref().is_none_or(|b| length < b.length) {
                    best = Some(Exit { halfedge: g, inward, point: add(at, scale(way, length)), length });
                }
            }
        }
        best
    }
}

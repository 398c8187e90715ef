//! How windows cross faces and how paths leave the vertices that they bend around.

use super::Scratch;
use super::envelope::{Queue, TIE, VERTEX, Window};
use super::topology::{Crossing, Fan, Topology};
use crate::error::Result;
use crate::job::Job;
use std::f64::consts::PI;

/// Half-width added to the range of directions in which a path may leave a vertex, radians.
const SLACK: f64 = 1e-5;
/// The same for a vertex that windows were given up for: those went past it from about where its shortest path comes from.
/// With a right angle, distances are the same as with all directions.
const WIDE: f64 = 0.5 * PI;
/// A path that bends no farther than this from where the straight one crosses an edge has the straight one's direction.
const STRAIGHT: f64 = 1e-9;
/// A source closer than this to an edge touches it.
const TOUCHING: f64 = 1e-6;
/// A window whose source is this close to the edge's line, outside the window, has no width but rounding.
const GRAZING: f64 = 1e-12;
/// Bounds the number of edges that one source may touch (and the depth of the recursion).
const MAX_TOUCHED: usize = 256;

/// Where the shortest known path to a vertex comes from.
#[derive(Debug, Clone, Copy)]
pub(super) enum Arrival {
    /// Every direction may go on: sources and their like.
    Any,
    /// Through the face of this corner, at an angle of this sine and cosine (times a length) from its first side.
    Corner(u32, f64, f64),
    /// Along this edge.
    Edge(u32),
}

/// One wave from one source.
pub(super) struct Wave<'a> {
    pub mesh: &'a Topology,
    pub state: &'a mut Scratch,
    /// Windows that gain no more than this over a path through a vertex are given up; at least TIE.
    pub tolerance: f64,
}

/// One of the two edges ahead of a window, in a frame in which the end that it shares with the window's edge is (0, 0),
/// that edge runs along x, and the apex is at (ax, ay).
struct Ahead {
    /// Edge ahead, coded as in [`Crossing`], and its length.
    code: u32,
    len: f64,
    /// The window, its source, and where the straight line from the source to the apex crosses its edge.
    b0: f64,
    b1: f64,
    px: f64,
    split: f64,
    ax: f64,
    /// Length of the window's edge, and the vertices at its near end and its far end.
    base: f64,
    near: u32,
    far: u32,
}

impl Wave<'_> {
    /// Lowers the distance of a vertex.
    #[inline]
    pub fn reach(&mut self, v: u32, distance: f64, arrival: impl FnOnce() -> Arrival) {
        let known = &mut self.state.dist[v as usize];
        if distance < *known - TIE {
            *known = distance;
            self.state.arrival[v as usize] = arrival();
            self.state.waiting[v as usize] = true;
            self.state.envelope.queue.push(distance, v | VERTEX);
        }
    }

    /// True if a path through vertex `v` is longer than a window's by no more than `excess` (throughout) and this is
    /// within the tolerance. If it is not simply shorter, the path through the vertex has to take the window's place,
    /// so from now on paths may bend at that vertex.
    #[inline]
    fn useless(&mut self, v: u32, excess: f64) -> bool {
        if excess > self.tolerance {
            return false;
        }
        if excess > TIE && !std::mem::replace(&mut self.state.bends[v as usize], true) && self.state.passed[v as usize]
        {
            self.state.waiting[v as usize] = true;
            self.state.envelope.queue.push(self.state.dist[v as usize], v | VERTEX);
        }
        true
    }

    /// True if an end of a window's edge, `len` long, makes it [`Wave::useless`].
    #[inline]
    fn loses(&mut self, w: &Window, len: f64) -> bool {
        let [o, e] = self.mesh.ends[w.edge as usize];
        let (d_o, d_e) = (self.state.dist[o as usize], self.state.dist[e as usize]);
        self.useless(o, d_o + w.b1 - w.at(w.b1)) || self.useless(e, d_e + (len - w.b0) - w.at(w.b0))
    }

    // --- faces

    /// Carries a window across every face of its edge but the one that it came through.
    pub fn propagate(&mut self, w: &Window) {
        let mesh = self.mesh;
        let [o, e] = mesh.ends[w.edge as usize];
        // Vertices may have come nearer since the window was made.
        if self.loses(w, mesh.crossings[mesh.first[w.edge as usize] as usize].len) {
            return;
        }
        for c in mesh.first[w.edge as usize]..mesh.first[w.edge as usize + 1] {
            let crossing = &mesh.crossings[c as usize];
            if crossing.face != w.face {
                self.cross(w, crossing, c, (o, e));
            }
        }
    }

    #[inline]
    fn cross(&mut self, w: &Window, c: &Crossing, index: u32, (o, e): (u32, u32)) {
        let (px, py, ax, ay) = (w.px, w.py, c.ax, c.ay);
        // Where the straight line from the source to the apex meets the edge.
        let split = if py + ay > 0.0 { px + (ax - px) * py / (py + ay) } else { ax };
        let through = split.clamp(w.b0, w.b1);
        // The apex is reached straight, or by a path bent at the window's end: always a real path, so a vertex that
        // rounding puts between two windows is not missed.
        let to_apex = w.at(through) + ((ax - through) * (ax - through) + ay * ay).sqrt();
        self.reach(c.apex, to_apex, || {
            let corner = &self.mesh.corners[index as usize];
            let far = if corner.left_first { 0.0 } else { c.len };
            // Angle at A between the corner's first side and the direction that the path comes from.
            let (fx, fy) = (far - ax, -ay);
            let straight = (through - split).abs() <= STRAIGHT;
            let (bx, by) = if straight { (px - ax, -ay - py) } else { (through - ax, -ay) };
            Arrival::Corner(index, (fx * by - fy * bx).abs(), fx * bx + fy * by)
        });
        let (b0, b1, base) = (w.b0, w.b1, c.len);
        self.carry(w, c, Ahead { code: c.left, len: c.left_len, b0, b1, px, split, ax, base, near: o, far: e });
        // The same seen from E.
        let [b0, b1, px, split, ax] = [b1, b0, px, split, ax].map(|x| base - x);
        self.carry(w, c, Ahead { code: c.right, len: c.right_len, b0, b1, px, split, ax, base, near: e, far: o });
    }

    /// Carries the part of a window that lies before `split` to an edge ahead, unless a path through a vertex is known
    /// to be shorter throughout.
    #[inline]
    fn carry(&mut self, w: &Window, c: &Crossing, a: Ahead) {
        let (py, ay) = (w.py, c.ay);
        if a.code & 2 == 0 || a.b0 >= a.split {
            return;
        }
        let from = meet(a.b0, a.px, py, a.ax, ay);
        let to = if a.b1 < a.split { meet(a.b1, a.px, py, a.ax, ay) } else { 1.0 };
        let (t0, t1) = (from * a.len, to * a.len);
        // The source in the frame of the edge ahead.
        let (qx, qy) = ((a.ax * a.px - ay * py) / a.len, ((a.ax * py + ay * a.px) / a.len).max(0.0));
        if !(t0 < t1) || (qy <= GRAZING && (qx <= t0 || qx >= t1)) {
            return;
        }
        let at = |t: f64| w.sigma + ((t - qx) * (t - qx) + qy * qy).sqrt();
        let (d0, d1) = (at(t0), at(t1));
        // Xin & Wang 2009: a vertex makes the window useless if the path through it to that end of the window which lies
        // across all the window's paths is no longer.
        let (x, y) = (from * a.ax - a.base, from * ay);
        let across = (x * x + y * y).sqrt();
        let [near, apex, far] = [a.near, c.apex, a.far].map(|v| self.state.dist[v as usize]);
        if self.useless(a.near, near + t1 - d1)
            || self.useless(c.apex, apex + (a.len - t0) - d0)
            || self.useless(a.far, far + across - d0)
        {
            return;
        }
        let (interval, qx) = if a.code & 1 == 0 { ((t0, t1), qx) } else { ((a.len - t1, a.len - t0), a.len - qx) };
        self.place(Window::new(a.code >> 2, c.face, interval, (qx, qy), w.sigma));
    }

    /// Adds a window to the envelope of its edge. A window whose source touches the edge (a vertex on the long side of a
    /// flat face, say) has all its directions in one point, which rounding may award to another window: it goes on
    /// across the edge at once and as a whole.
    pub fn place(&mut self, w: Window) {
        if w.py > TOUCHING || w.px <= w.b0 || w.px >= w.b1 {
            return self.state.envelope.insert(w);
        }
        if self.state.touched.len() == MAX_TOUCHED || self.state.touched.contains(&w.edge) {
            return;
        }
        self.state.touched.push(w.edge);
        self.propagate(&w);
        self.state.envelope.insert(w.done());
        if self.state.touched[0] == w.edge {
            self.state.touched.clear();
        }
    }

    // --- vertices

    /// Carries the distance of `v` along its edges and, where paths bend around it, into its faces.
    pub fn leave(&mut self, v: u32) {
        let mesh = self.mesh;
        let distance = self.state.dist[v as usize];
        let corners = mesh.around_first[v as usize] as usize..mesh.around_first[v as usize + 1] as usize;
        let arrival = self.state.arrival[v as usize];
        let fan = mesh.fans[v as usize];
        let all = matches!(arrival, Arrival::Any) || fan == Fan::Complex;
        // a window that was given up went past the vertex, on its way ahead
        let bends = self.state.bends[v as usize];
        let aside = if bends { WIDE } else { SLACK };
        let bends = bends || fan.is_saddle();
        let from = if all || !bends { 0.0 } else { self.arrival_angle(v, arrival) };
        for &c in &mesh.around[corners] {
            let crossing = &mesh.crossings[c as usize];
            let corner = &mesh.corners[c as usize];
            let [o, e] = mesh.ends[corner.edge as usize];
            self.reach(o, distance + crossing.left_len, || Arrival::Edge(crossing.left / 4));
            self.reach(e, distance + crossing.right_len, || Arrival::Edge(crossing.right / 4));
            if mesh.first[corner.edge as usize + 1] - mesh.first[corner.edge as usize] < 2 {
                continue;
            }
            let (lo, hi) = (corner.start, corner.start + corner.angle);
            let mut emit = |from: f64, to: f64| self.emit(c, from.max(lo) - lo, to.min(hi) - lo, distance);
            match fan {
                _ if all => emit(lo, hi),
                Fan::Open(total) if bends => {
                    emit(from + PI - aside, total);
                    emit(0.0, from - PI + aside);
                }
                Fan::Closed(total) if bends => {
                    let half = (0.5 * total - PI).max(0.0) + aside;
                    let (first, last) = (from + 0.5 * total - half, from + 0.5 * total + half);
                    emit(first, last);
                    emit(first - total, last - total);
                }
                _ => {}
            }
        }
    }

    /// The fan angle that a path arrives from.
    fn arrival_angle(&self, v: u32, arrival: Arrival) -> f64 {
        let mesh = self.mesh;
        match arrival {
            Arrival::Any => 0.0,
            Arrival::Corner(c, sine, cosine) => mesh.corners[c as usize].start + sine.atan2(cosine),
            Arrival::Edge(edge) => {
                let corners = mesh.around_first[v as usize] as usize..mesh.around_first[v as usize + 1] as usize;
                for &c in &mesh.around[corners] {
                    let (crossing, corner) = (&mesh.crossings[c as usize], &mesh.corners[c as usize]);
                    if crossing.left / 4 == edge || crossing.right / 4 == edge {
                        let first = (crossing.left / 4 == edge) == corner.left_first;
                        return corner.start + if first { 0.0 } else { corner.angle };
                    }
                }
                0.0
            }
        }
    }

    /// Emits a window from the apex of crossing `c` through angles `from..to` of its corner to the opposite edge.
    fn emit(&mut self, c: u32, from: f64, to: f64, sigma: f64) {
        let (crossing, corner) = (&self.mesh.crossings[c as usize], &self.mesh.corners[c as usize]);
        let (len, ax, ay) = (crossing.len, crossing.ax, crossing.ay);
        if from > to || (ay == 0.0 && (ax <= 0.0 || ax >= len)) {
            return;
        }
        // A ray at `angle` from the corner's first side meets the opposite edge here.
        let meet = |angle: f64| {
            if corner.left_first {
                let psi = (-ax).atan2(ay) + angle;
                if psi >= PI / 2.0 { len } else { (ax + ay * psi.tan()).clamp(0.0, len) }
            } else {
                let psi = (len - ax).atan2(ay) - angle;
                if psi <= -PI / 2.0 { 0.0 } else { (ax + ay * psi.tan()).clamp(0.0, len) }
            }
        };
        let whole = ay == 0.0;
        let first = if from <= 0.0 || whole { None } else { Some(meet(from)) };
        let second = if to >= corner.angle || whole { None } else { Some(meet(to)) };
        let (b0, b1) = if corner.left_first {
            (first.unwrap_or(0.0), second.unwrap_or(len))
        } else {
            (second.unwrap_or(0.0), first.unwrap_or(len))
        };
        if b0 < b1 {
            let w = Window::new(corner.edge, crossing.face, (b0, b1), (ax, ay), sigma);
            // as when it is propagated, by when most of what leaves a vertex has lost
            if !self.loses(&w, len) {
                self.place(w);
            }
        }
    }

    // --- the wave

    /// Propagates in order of distance until every vertex of the component, of which `pending` are left, has been
    /// passed and nothing nearer than `stop` waits. Returns false if the window limit was met.
    pub fn run(&mut self, pending: &mut u32, stop: f64, job: &Job) -> Result<bool> {
        let mut steps = 0u32;
        let mut last = Queue::key(stop);
        while let Some((key, id)) = self.state.envelope.queue.pop() {
            if *pending == 0 && key > last {
                self.state.envelope.queue.push_key(key, id);
                break;
            }
            if id & VERTEX != 0 {
                let v = id & !VERTEX;
                if std::mem::take(&mut self.state.waiting[v as usize]) {
                    if !std::mem::replace(&mut self.state.passed[v as usize], true) {
                        *pending -= 1;
                        last = last.max(key);
                    }
                    self.leave(v);
                }
            } else if let Some(w) = self.state.envelope.take(id) {
                self.propagate(&w);
            }
            if self.state.envelope.exhausted() {
                return Ok(false);
            }
            steps += 1;
            if steps % 4096 == 0 {
                job.check()?;
            }
        }
        Ok(true)
    }
}

/// The fraction of O-A, with A = (ax, ay), at which the ray from (px, -py) through (b, 0) crosses it.
#[inline]
fn meet(b: f64, px: f64, py: f64, ax: f64, ay: f64) -> f64 {
    if ay == 0.0 {
        return if ax > 0.0 { (b / ax).clamp(0.0, 1.0) } else { 0.0 };
    }
    let along = py * ax + (px - b) * ay;
    if along > 0.0 { (b * py / along).clamp(0.0, 1.0) } else { 1.0 }
}

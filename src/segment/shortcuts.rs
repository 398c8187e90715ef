//! Where a part hangs with its body by flat surface: the short-cut rule.
//!
//! The tooth of a gear, the tine of a fork and the point of a star are flush with their body above and below; the only
//! creases between them run from one flat side to the other, and are as long as the plate is thick. People cut such an
//! outline along the shortest lines that begin in its concave corners (Singh, Seyranian & Hoffman 1999, "Parsing
//! silhouettes: the short-cut rule"). Here these lines are drawn on the flat side: a step over one turns a little more than
//! is neutral, so that a cut along it costs nothing and the creases at its ends decide.

use super::creases::Walker;
use super::dual::{Dual, step_count};
use crate::error::{Result, try_filled, try_push};
use crate::job::Job;
use crate::mesh::NONE;
use crate::mesh::measure::{Vec3, cross, dot, norm, scale, sub};
use hashbrown::HashMap;
use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

/// Edges that turn more than this are creases (radians).
const CREASE: f64 = 0.5;
/// Cosine of the angle between a crease and the normal of the flat side that it ends at, at least.
const SQUARE: f64 = 0.9;
/// Faces of one flat side have normals with at least this cosine.
const FLAT: f64 = 1.0 - 1e-6;
/// What lies beyond a line has an outline so many times as long as the line.
const SPUR: f64 = 2.5;
/// A corner is concave if it is wider than a straight line by this, radians.
const CONCAVE: f64 = 0.08;
/// Lines keep this angle from the outline, radians.
const ASIDE: f64 = 0.05;
/// A line to another concave corner is preferred to one to the outline that is shorter by this factor.
const PREFERRED: f64 = 1.5;
/// Flat sides with more corners than this are rough, not cut out.
const MOST: usize = 128;
/// A line to the outline parts a thing from something so many times as wide, or one that reaches so far along the crease.
const BENT: f64 = 2.5;
/// What a step over a line turns, radians: a little more than neutral.
const CUT: f64 = 0.62;
/// A line goes on over the edge of its side if what is flush there is at most so many times as wide as the crease is long.
const FOLD: f64 = 1.25;
/// An outline is straight as long as it turns less than this, radians.
const STRAIGHT: f64 = 0.2;

type Point = [f64; 2];

/// The end of a concave crease.
#[derive(Clone, Copy)]
struct End {
    /// Unit vector along the crease, away from the end.
    along: Vec3,
    turn: f64,
    /// Length of the crease.
    length: f64,
}

/// A concave corner of the outline of a flat side.
struct Corner {
    vertex: u32,
    at: Point,
    /// Direction in which the outline goes on, as an angle.
    from: f64,
    /// Interior angle.
    inside: f64,
    /// How much wider it is thought to be: a rounded corner turns on both sides of its middle, too.
    more: f64,
    /// Length of the shorter straight piece of the outline beside it, and of the crease that ends here.
    beside: f64,
    crease: f64,
    /// Lines that end here, as angles from `from`.
    lines: Vec<f64>,
}

/// A line that may be drawn.
struct Line {
    rank: f64,
    ends: [Point; 2],
    corners: [Option<usize>; 2],
}

/// Faces that are marked, by the number of the time when they were.
struct Marks {
    of_face: Vec<u32>,
    now: u32,
}

impl Marks {
    fn new(faces: usize) -> Result<Marks> {
        Ok(Marks { of_face: try_filled(faces, 0, "flat sides")?, now: 0 })
    }

    /// Marks a face; false if it was.
    fn set(&mut self, f: u32) -> bool {
        std::mem::replace(&mut self.of_face[f as usize], self.now) != self.now
    }

    fn has(&self, f: u32) -> bool {
        self.of_face[f as usize] == self.now
    }
}

/// A flat side and its outline.
struct Side<'a> {
    faces: Vec<u32>,
    /// They are marked.
    marks: &'a Marks,
    origin: Vec3,
    axes: [Vec3; 2],
    /// Edges of the outline, the side to their left.
    outline: Vec<[u32; 2]>,
    next: HashMap<u32, u32>,
    last: HashMap<u32, u32>,
    /// By vertex the loop of the outline and the way along it; by loop its length.
    place: HashMap<u32, (usize, f64)>,
    lengths: Vec<f64>,
}

/// Gives steps over short lines between concave corners of flat sides a turn, as if there were a crease.
///
/// # Errors
/// [`crate::error::Error::Cancelled`].
pub fn draw(dual: &mut Dual, walker: &Walker<'_>, job: &Job) -> Result<()> {
    let ends = crease_ends(dual, walker);
    if ends.is_empty() {
        return Ok(());
    }
    let mut around: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    let mut is_end = try_filled(walker.positions.len(), false, "ends of creases")?;
    ends.keys().for_each(|&v| is_end[v as usize] = true);
    for (f, t) in walker.triangles.iter().enumerate() {
        for v in t.iter().filter(|v| is_end[**v as usize]) {
            around.entry(*v).or_default().push(f as u32);
        }
    }
    let mut seen = try_filled(walker.triangles.len(), false, "flat sides")?;
    let mut marks = [Marks::new(seen.len())?, Marks::new(seen.len())?];
    let [here, beyond] = &mut marks;
    for (v, faces) in &around {
        let end = ends[v];
        let facing = |f: &u32| -dot(dual.normal[*f as usize], end.along);
        let Some(&seed) = faces.iter().max_by(|a, b| facing(a).total_cmp(&facing(b))) else { continue };
        if facing(&seed) < SQUARE || seen[seed as usize] {
            continue;
        }
        job.check()?;
        let side = Side::new(dual, walker, seed, here)?;
        side.faces.iter().for_each(|&f| seen[f as usize] = true);
        let mut corners = side.corners(walker, &ends);
        if corners.is_empty() || corners.len() > MOST {
            continue;
        }
        let lines = side.lines(walker, &mut corners);
        lines.iter().for_each(|line| side.mark(dual, line.ends));
        for line in lines {
            if let [Some(k), None] = line.corners {
                side.fold(dual, walker, line.ends[1], corners[k].crease, beyond)?;
            }
        }
    }
    Ok(())
}

/// Vertices at which one concave crease ends.
fn crease_ends(dual: &Dual, walker: &Walker<'_>) -> BTreeMap<u32, End> {
    let mut edges: BTreeMap<u32, Vec<(u32, f64)>> = BTreeMap::new();
    let mut s = 0;
    for e in 0..walker.topology.edge_count() as u32 {
        let sides = walker.topology.halfedges(e);
        if sides.len() == 2 && dual.steps[s].turn > CREASE {
            let (t, k) = (walker.triangles[sides[0] as usize / 3], sides[0] as usize % 3);
            let (a, b) = (t[k], t[(k + 1) % 3]);
            for (v, w) in [(a, b), (b, a)] {
                edges.entry(v).or_default().push((w, dual.steps[s].turn));
            }
        }
        s += step_count(sides.len());
    }
    let end = |(&v, around): (&u32, &Vec<(u32, f64)>)| {
        let &[(next, turn)] = &around[..] else { return None };
        let gap = |v: u32, w: u32| sub(walker.positions[w as usize], walker.positions[v as usize]);
        let along = gap(v, next);
        let (mut length, mut way) = (norm(along), [v, next]);
        while let Some(&[(a, _), (b, _)]) = edges.get(&way[1]).map(|around| &around[..]) {
            way = [way[1], if a == way[0] { b } else { a }];
            length += norm(gap(way[0], way[1]));
        }
        let first = norm(along).max(f64::MIN_POSITIVE);
        Some((v, End { along: scale(along, 1.0 / first), turn, length }))
    };
    edges.iter().filter_map(end).collect()
}

fn minus(p: Point, q: Point) -> Point {
    [p[0] - q[0], p[1] - q[1]]
}

fn wedge(p: Point, q: Point) -> f64 {
    p[0] * q[1] - p[1] * q[0]
}

fn long(p: Point, q: Point) -> f64 {
    (p[0] - q[0]).hypot(p[1] - q[1])
}

fn angle(p: Point) -> f64 {
    p[1].atan2(p[0])
}

/// Whether two segments cross, ends not counted.
fn cross_over([p, q]: [Point; 2], [a, b]: [Point; 2]) -> bool {
    let (d, e) = (minus(q, p), minus(b, a));
    let (s, t) = (wedge(d, minus(a, p)), wedge(d, minus(b, p)));
    let (u, v) = (wedge(e, minus(p, a)), wedge(e, minus(q, a)));
    s * t < 0.0 && u * v < 0.0
}

/// How far along `way` a line from a point meets a segment.
fn meets(from: Point, way: Point, p: Point, q: Point) -> Option<f64> {
    let (edge, off) = (minus(q, p), minus(p, from));
    let steep = wedge(way, edge);
    let (c, share) = (wedge(off, edge) / steep, wedge(off, way) / steep);
    (steep != 0.0 && (0.0..=1.0).contains(&share)).then_some(c)
}

impl<'a> Side<'a> {
    fn new(dual: &Dual, walker: &Walker<'_>, seed: u32, marks: &'a mut Marks) -> Result<Side<'a>> {
        let normal = dual.normal[seed as usize];
        let [p, q, _] = walker.triangles[seed as usize].map(|v| walker.positions[v as usize]);
        let x = sub(q, p);
        let x = scale(x, 1.0 / norm(x).max(f64::MIN_POSITIVE));
        marks.now += 1;
        let (mut stack, mut faces) = (vec![seed], Vec::new());
        while let Some(f) = stack.pop() {
            if marks.set(f) {
                try_push(&mut faces, f, "flat sides")?;
                for &(g, _) in dual.around(f) {
                    if !marks.has(g) && dot(dual.normal[g as usize], normal) >= FLAT {
                        try_push(&mut stack, g, "flat sides")?;
                    }
                }
            }
        }
        let mut side = Side {
            faces,
            marks,
            origin: p,
            axes: [x, cross(normal, x)],
            outline: Vec::new(),
            next: HashMap::new(),
            last: HashMap::new(),
            place: HashMap::new(),
            lengths: Vec::new(),
        };
        let mut pinched: Vec<u32> = Vec::new();
        for k in 0..side.faces.len() {
            let f = side.faces[k];
            for h in 3 * f..3 * f + 3 {
                let twin = walker.topology.twin(h);
                if twin == NONE || !side.marks.has(twin / 3) {
                    let (t, k) = (walker.triangles[f as usize], h as usize % 3);
                    let (a, b) = (t[k], t[(k + 1) % 3]);
                    try_push(&mut side.outline, [a, b], "flat sides")?;
                    let twice = side.next.insert(a, b).is_some();
                    if side.last.insert(b, a).is_some() || twice {
                        pinched.extend([a, b]);
                    }
                }
            }
        }
        for v in pinched {
            side.next.remove(&v);
            side.last.remove(&v);
        }
        side.walk_around(walker);
        Ok(side)
    }

    fn flat(&self, walker: &Walker<'_>, v: u32) -> Point {
        self.project(walker.positions[v as usize])
    }

    fn project(&self, p: Vec3) -> Point {
        self.axes.map(|a| dot(sub(p, self.origin), a))
    }

    /// --- how far along the outline its vertices are
    fn walk_around(&mut self, walker: &Walker<'_>) {
        for k in 0..self.outline.len() {
            let start = self.outline[k][0];
            let (mut v, mut way, id) = (start, 0.0, self.lengths.len());
            while !self.place.contains_key(&v) {
                self.place.insert(v, (id, way));
                let Some(&w) = self.next.get(&v) else { break };
                way += long(self.flat(walker, v), self.flat(walker, w));
                v = w;
            }
            // an open chain or one that runs into another has no length that could be divided
            self.lengths.push(if v == start { way } else { 0.0 });
        }
    }

    fn corners(&self, walker: &Walker<'_>, ends: &BTreeMap<u32, End>) -> Vec<Corner> {
        let corner = |v: u32| -> Option<Corner> {
            let (end, &next, &last) = (ends.get(&v)?, self.next.get(&v)?, self.last.get(&v)?);
            let at = self.flat(walker, v);
            let from = angle(minus(self.flat(walker, next), at));
            let inside = (angle(minus(self.flat(walker, last), at)) - from).rem_euclid(TAU);
            let more = (PI + end.turn - inside).max(0.0);
            let concave = inside > PI - CONCAVE && inside + more > PI + CONCAVE;
            let beside = self.straight(walker, v, more, &self.next).min(self.straight(walker, v, more, &self.last));
            concave.then_some(Corner {
                vertex: v,
                at,
                from,
                inside,
                more,
                beside,
                crease: end.length,
                lines: Vec::new(),
            })
        };
        self.outline.iter().filter_map(|e| corner(e[0])).collect()
    }

    /// How far the outline runs straight on from a vertex, past half of a rounded corner.
    fn straight(&self, walker: &Walker<'_>, start: u32, more: f64, along: &HashMap<u32, u32>) -> f64 {
        let (mut v, mut way, mut turned) = (start, 0.0, 0.0);
        let mut before: Option<f64> = None;
        while let Some(&w) = along.get(&v) {
            let (p, q) = (self.flat(walker, v), self.flat(walker, w));
            let direction = angle(minus(q, p));
            if let Some(before) = before {
                let turn = (direction - before).rem_euclid(TAU);
                turned += turn.min(TAU - turn);
            }
            if turned > STRAIGHT + 0.5 * more || (w == start) {
                break;
            }
            way += long(p, q);
            (v, before) = (w, Some(direction));
        }
        way
    }

    /// Length of the shorter way along the outline between two places of one loop, none between two loops.
    fn apart(&self, a: (usize, f64), b: (usize, f64)) -> Option<f64> {
        let way = (a.1 - b.1).abs();
        (a.0 == b.0).then(|| way.min(self.lengths[a.0] - way))
    }

    /// The lines that are drawn: the shortest first, from corners that are still concave, none across another.
    fn lines(&self, walker: &Walker<'_>, corners: &mut [Corner]) -> Vec<Line> {
        let outline: Vec<([u32; 2], [Point; 2])> =
            self.outline.iter().map(|&e| (e, e.map(|v| self.flat(walker, v)))).collect();
        let mut open: Vec<Line> = Vec::new();
        for (k, a) in corners.iter().enumerate() {
            for (m, b) in corners.iter().enumerate().skip(k + 1) {
                let c = long(a.at, b.at);
                if self.apart(self.place[&a.vertex], self.place[&b.vertex]).is_some_and(|way| way >= SPUR * c) {
                    open.push(Line { rank: c, ends: [a.at, b.at], corners: [Some(k), Some(m)] });
                }
            }
            // straight on from either side of the corner: where both ways are as short, a bar of that width is bent
            let ways = [a.from + PI, a.from + a.inside + PI];
            let on = ways.map(|way| self.straight_on(&outline, a, [way.cos(), way.sin()]));
            let reach = on.map(|o| o.map_or(f64::INFINITY, |o| o.0));
            for (o, other) in on.into_iter().zip([reach[1], reach[0]]) {
                // a notch is no neck: the line is no longer than the step of the outline that it starts from
                if let Some((c, end, around)) = o
                    && around >= SPUR * c
                    && c <= a.beside
                    && (other >= BENT * c || a.crease >= BENT * c)
                {
                    open.push(Line { rank: PREFERRED * c, ends: [a.at, end], corners: [Some(k), None] });
                }
            }
        }
        let key = |l: &Line| [l.rank, l.ends[0][0] + l.ends[1][0], l.ends[0][1] + l.ends[1][1]];
        open.sort_by(|a, b| {
            let (a, b) = (key(a), key(b));
            a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])).then(a[2].total_cmp(&b[2]))
        });
        let mut drawn: Vec<Line> = Vec::new();
        for line in open {
            let ways = [minus(line.ends[1], line.ends[0]), minus(line.ends[0], line.ends[1])];
            let turns = [0, 1].map(|e| line.corners[e].map(|k| (k, corners[k].aside(angle(ways[e])))));
            if turns.iter().flatten().any(|(_, t)| t.is_none()) {
                continue;
            }
            let useful = turns.iter().flatten().any(|&(k, t)| t.is_some_and(|t| corners[k].is_open(t)));
            let own = |v: u32| line.corners.iter().flatten().any(|&k| corners[k].vertex == v);
            let blocked = || {
                let mut edges = outline.iter().filter(|(e, _)| !own(e[0]) && !own(e[1]));
                edges.any(|(_, ends)| cross_over(line.ends, *ends))
                    || drawn.iter().any(|d| cross_over(line.ends, d.ends))
            };
            if useful && !blocked() {
                turns.into_iter().flatten().for_each(|(k, t)| corners[k].lines.extend(t));
                drawn.push(line);
            }
        }
        drawn
    }

    /// Where the line from a corner in a direction meets the outline: how far away, at which point, and how far it is along
    /// the outline; none if that is another loop.
    fn straight_on(&self, outline: &[([u32; 2], [Point; 2])], a: &Corner, way: Point) -> Option<(f64, Point, f64)> {
        let mut best: Option<(f64, u32, f64)> = None;
        for ([v, w], [p, q]) in outline.iter().filter(|(e, _)| e[0] != a.vertex && e[1] != a.vertex) {
            let (edge, off) = (minus(*q, *p), minus(*p, a.at));
            let steep = wedge(way, edge);
            let (c, share) = (wedge(off, edge) / steep, wedge(off, way) / steep);
            if steep != 0.0 && c > 0.0 && (0.0..=1.0).contains(&share) && best.is_none_or(|b| c < b.0) {
                best = Some(if share < 1.0 { (c, *v, share * long(*p, *q)) } else { (c, *w, 0.0) });
            }
        }
        let (c, v, beyond) = best?;
        let (id, at) = *self.place.get(&v)?;
        let around = self.apart(self.place[&a.vertex], (id, at + beyond))?;
        // not quite to the outline, so that it does not cross it
        let short = c * (1.0 - 1e-9);
        Some((c, [a.at[0] + short * way[0], a.at[1] + short * way[1]], around))
    }

    /// --- a line that ends on an edge goes on around it, straight across what is flush there, if that is no wider than
    /// the crease is long
    fn fold(&self, dual: &mut Dual, walker: &Walker<'_>, end: Point, crease: f64, room: &mut Marks) -> Result<()> {
        let at: Vec3 = std::array::from_fn(|k| self.origin[k] + end[0] * self.axes[0][k] + end[1] * self.axes[1][k]);
        let off = |h: u32| {
            let (t, k) = (walker.triangles[h as usize / 3], h as usize % 3);
            let [a, b] = [t[k], t[(k + 1) % 3]].map(|v| self.flat(walker, v));
            let (edge, to) = (minus(b, a), minus(end, a));
            let share = (to[0] * edge[0] + to[1] * edge[1]) / (edge[0] * edge[0] + edge[1] * edge[1]);
            let share = if share > 0.0 { share.min(1.0) } else { 0.0 };
            long(to, edge.map(|x| share * x))
        };
        let beyond = |h: &u32| walker.topology.twin(*h) != NONE && !self.marks.has(walker.topology.twin(*h) / 3);
        let edges = self.faces.iter().flat_map(|f| 3 * f..3 * f + 3).filter(beyond).map(|h| (off(h), h));
        let Some((_, edge)) = edges.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))) else { return Ok(()) };
        let side = Side::new(dual, walker, walker.topology.twin(edge) / 3, room)?;
        let down = scale(cross(self.axes[0], self.axes[1]), -1.0);
        let (from, way) = (side.project(at), side.axes.map(|a| dot(a, down)));
        if way[0].hypot(way[1]) < SQUARE {
            return Ok(());
        }
        let outline = side.outline.iter().map(|e| e.map(|v| side.flat(walker, v)));
        let ends = outline.filter_map(|[p, q]| meets(from, way, p, q)).filter(|c| *c > 1e-3 * crease);
        let length = ends.fold(f64::INFINITY, f64::min);
        if length <= FOLD * crease {
            side.mark(dual, [from, [from[0] + length * way[0], from[1] + length * way[1]]]);
        }
        Ok(())
    }

    /// --- steps between faces on two sides of a line
    fn mark(&self, dual: &mut Dual, [p, q]: [Point; 2]) {
        let whole = long(p, q).max(f64::MIN_POSITIVE);
        let way = minus(q, p).map(|x| x / whole);
        let place = |f: u32| {
            let c = minus(self.project(dual.centroid[f as usize]), p);
            [c[0] * way[0] + c[1] * way[1], wedge(way, c)]
        };
        let mut over: Vec<u32> = Vec::new();
        for &f in &self.faces {
            let a = place(f);
            for &(g, s) in dual.around(f).iter().filter(|n| n.0 > f && self.marks.has(n.0)) {
                let b = place(g);
                if (a[1] < 0.0) != (b[1] < 0.0) {
                    let middle = a[0] + (b[0] - a[0]) * a[1] / (a[1] - b[1]);
                    let slack = 0.5 * long(a, b);
                    if middle >= -slack && middle <= whole + slack {
                        over.push(s);
                    }
                }
            }
        }
        for s in over {
            let turn = &mut dual.steps[s as usize].turn;
            *turn = turn.max(CUT);
        }
    }
}

impl Corner {
    /// The angle of a direction from the outline, if it leads inside and not along the outline.
    fn aside(&self, direction: f64) -> Option<f64> {
        let turn = (direction - self.from).rem_euclid(TAU);
        (turn > ASIDE && turn < self.inside - ASIDE).then_some(turn)
    }

    /// Whether the corner is still concave between the lines beside a direction.
    fn is_open(&self, turn: f64) -> bool {
        let below = self.lines.iter().copied().filter(|t| *t <= turn).fold(0.0, f64::max);
        let above = self.lines.iter().copied().filter(|t| *t > turn).fold(self.inside, f64::min);
        // half of what a rounded corner is wider lies on each of its sides
        let half = |edge: bool| if edge { 0.5 * self.more } else { 0.0 };
        let wide = above - below + half(below == 0.0) + half(above == self.inside);
        wide > PI + CONCAVE
    }
}

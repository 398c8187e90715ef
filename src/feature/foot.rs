//! The fillet at the foot of a feature: concave faces beside its border.
//!
//! A pin with a wide fillet is no more slender than the pin without. The border of a feature runs along the middle of the
//! fillet, so that half of it lies within the feature; its length is measured without that half.

use crate::mesh::measure::{Vec3, add, cross, dot, norm, scale, sub};
use crate::mesh::sets::SparseSets;
use crate::segment::dual::Dual;
use hashbrown::{HashMap, HashSet};
use std::collections::BTreeMap;

/// Turns between these are steps of a fillet (radians): less is flat, more is an edge.
const STEPS: [f64; 2] = [0.01, 1.0];
/// A fillet's radius is at most so many thicknesses of the feature that it carries.
const RADIUS: f64 = 2.0;
/// A border is a foot if so much of its length lies in a fillet: the bow of a handle is hollow on one side only.
const AROUND: f64 = 0.6;
/// And if so much of its length runs along the steps of that fillet: the rest may cross its facets.
const STEPPED: f64 = 0.1;
/// What stands on a border rises from it: the cosine between the way up and its faces' normals is below this.
const UPRIGHT: f64 = 0.5;
/// Fillets are at most this share of the feature's area: more is the feature itself.
const SHARE: f64 = 0.35;

/// A feature, its mesh and the thickness of the feature.
pub struct Standing<'a> {
    /// Vertices.
    pub positions: &'a [Vec3],
    /// Faces, oriented outward.
    pub triangles: &'a [[u32; 3]],
    /// Their neighbours.
    pub dual: &'a Dual,
    /// Their features.
    pub label: &'a [u32],
    /// The feature.
    pub own: u32,
    /// Its thickness, model units.
    pub thickness: f64,
}

/// An edge of a border: the face inside, its length, its turn, its ends.
struct Side {
    face: u32,
    length: f64,
    turn: f64,
    ends: [u32; 2],
}

/// The flat groups that the faces of a feature form.
struct Flats {
    /// The group of every face.
    of: HashMap<u32, u32>,
    /// By group: how much its concave edges turn, by length, and its area.
    sums: HashMap<u32, (f64, f64)>,
}

impl Standing<'_> {
    /// The faces of the feature without those of the fillets that it stands on, `faces` being all of its faces; none
    /// if it stands on no fillet, or if that were too much of it.
    pub fn above(&self, faces: &[u32]) -> Option<Vec<u32>> {
        let length = |sides: &[Side]| sides.iter().map(|s| s.length).sum::<f64>();
        let share = |sides: &[Side], of: &dyn Fn(&Side) -> bool| {
            sides.iter().filter(|s| of(s)).map(|s| s.length).sum::<f64>() / length(sides).max(f64::MIN_POSITIVE)
        };
        let mut borders = self.borders(faces);
        borders.retain(|b| share(b, &|s| is_step(s.turn)) >= STEPPED && share(b, &|s| is_gentle(s.turn)) >= AROUND);
        if borders.is_empty() {
            return None;
        }
        let flats = self.flats(faces);
        let mut foot: HashSet<u32> = HashSet::new();
        for border in borders {
            // it may leave the edges of the facets and cross them
            let within = |s: &Side| is_gentle(s.turn) && self.hollow(&flats, s.face);
            // or run along its last step
            if share(&border, &|s| within(s) || is_step(s.turn)) >= AROUND {
                let fillet = self.grown(&flats, border.iter().filter(|s| within(s)).map(|s| s.face).collect());
                if self.rises(&border, &fillet) {
                    foot.extend(fillet);
                }
            }
        }
        let area = |faces: &[u32]| faces.iter().map(|&f| self.dual.area[f as usize]).sum::<f64>();
        let above: Vec<u32> = faces.iter().copied().filter(|f| !foot.contains(f)).collect();
        (above.len() < faces.len() && area(&above) >= (1.0 - SHARE) * area(faces)).then_some(above)
    }

    /// --- flat groups of faces
    fn flats(&self, faces: &[u32]) -> Flats {
        let mut sets = SparseSets::default();
        for &f in faces {
            for &(g, s) in self.around(f) {
                if self.dual.steps[s as usize].turn.abs() <= STEPS[0] {
                    sets.join(f, g);
                }
            }
        }
        let mut sums: HashMap<u32, (f64, f64)> = HashMap::new();
        let of: HashMap<u32, u32> = faces.iter().map(|&f| (f, sets.root(f))).collect();
        for &f in faces {
            let steps = self.dual.around(f).iter().map(|a| &self.dual.steps[a.1 as usize]);
            // half of an edge's turn belongs to each of its faces
            let bend: f64 = steps.filter(|s| is_step(s.turn)).map(|s| 0.5 * s.length * s.turn).sum();
            let sum = sums.entry(of[&f]).or_insert((0.0, 0.0));
            *sum = (sum.0 + bend, sum.1 + self.dual.area[f as usize]);
        }
        Flats { of, sums }
    }

    /// Neighbours of a face within the feature.
    fn around(&self, f: u32) -> impl Iterator<Item = &(u32, u32)> {
        self.dual.around(f).iter().filter(|a| self.label[a.0 as usize] == self.own)
    }

    /// Whether the surface bends inward at a face as narrowly as a fillet does: the turn of the concave edges over the
    /// area is one over the radius.
    fn hollow(&self, flats: &Flats, f: u32) -> bool {
        let (bend, area) = flats.sums[&flats.of[&f]];
        bend * RADIUS * self.thickness > area
    }

    /// --- from the border upward, as long as the surface is hollow
    fn grown(&self, flats: &Flats, mut stack: Vec<u32>) -> HashSet<u32> {
        let mut fillet: HashSet<u32> = HashSet::new();
        while let Some(f) = stack.pop() {
            if fillet.insert(f) {
                stack.extend(self.around(f).map(|a| a.0).filter(|&g| !fillet.contains(&g) && self.hollow(flats, g)));
            }
        }
        fillet
    }

    /// Whether the feature rises from a border, beyond the fillet, and is not just pierced by it.
    fn rises(&self, border: &[Side], fillet: &HashSet<u32>) -> bool {
        let Some(&[from, _]) = border.first().map(|s| &s.ends) else { return false };
        let at = |v: u32| sub(self.positions[v as usize], self.positions[from as usize]);
        let up = border.iter().fold([0.0; 3], |m, s| add(m, cross(at(s.ends[0]), at(s.ends[1]))));
        let up = scale(up, 1.0 / norm(up).max(f64::MIN_POSITIVE));
        let (mut lean, mut whole) = (0.0, 0.0);
        let mut beyond: Vec<(u32, u32)> = fillet.iter().flat_map(|&f| self.around(f)).copied().collect();
        beyond.sort_unstable();
        for (g, s) in beyond.into_iter().filter(|a| !fillet.contains(&a.0)) {
            let length = self.dual.steps[s as usize].length;
            lean += length * dot(self.dual.normal[g as usize], up).abs();
            whole += length;
        }
        lean < UPRIGHT * whole
    }

    /// The border by closed curve.
    fn borders(&self, faces: &[u32]) -> Vec<Vec<Side>> {
        let mut sides: Vec<Side> = Vec::new();
        for &f in faces {
            for &(g, s) in self.dual.around(f).iter().filter(|a| self.label[a.0 as usize] != self.own) {
                let (t, other) = (self.triangles[f as usize], self.triangles[g as usize]);
                // the corner that the other face lacks is followed by the common edge
                if let Some(k) = (0..3).find(|&k| !other.contains(&t[k])) {
                    let step = &self.dual.steps[s as usize];
                    let ends = [t[(k + 1) % 3], t[(k + 2) % 3]];
                    sides.push(Side { face: f, length: step.length, turn: step.turn, ends });
                }
            }
        }
        let mut sets = SparseSets::default();
        sides.iter().for_each(|side| sets.join(side.ends[0], side.ends[1]));
        let mut out: BTreeMap<u32, Vec<Side>> = BTreeMap::new();
        for side in sides {
            out.entry(sets.root(side.ends[0])).or_default().push(side);
        }
        out.into_values().collect()
    }
}

/// A step of a fillet, or flat.
fn is_gentle(turn: f64) -> bool {
    (-STEPS[0]..STEPS[1]).contains(&turn)
}

fn is_step(turn: f64) -> bool {
    turn > STEPS[0] && turn < STEPS[1]
}

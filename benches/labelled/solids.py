"""Three ways to make a part of which every triangle is known: exact booleans of meshes, CAD, and implicit functions.

Each part collects `features` (kind, smallest dimension) and solids that belong to them, and `mesh()` gives vertices,
triangles and the feature of every triangle: by the solid that a triangle comes from (booleans), by the solid on whose
surface the middle of the triangle lies (CAD; fillets lie on none: -1), or by the nearest primitive (implicit; -1 where
two of them are blended). A label may be a function of the middles of triangles, for features that are one outline.
"""
import math

import manifold3d
import numpy as np
from manifold3d import CrossSection, Manifold


class Part:
    """Features and the solids they are made of."""

    def __init__(self):
        self.features, self.solids = [], []

    def feature(self, kind, small):
        """A new feature with its smallest dimension; gives its label."""
        self.features.append((kind, float(small)))
        return len(self.features) - 1

    def add(self, label, solid):
        """Material of a feature (label: number, or function of middles)."""
        self.solids.append((+1, label, solid))
        return self

    def cut(self, label, solid):
        """Taken away after all was added; its walls belong to the feature."""
        self.solids.append((-1, label, solid))
        return self


def label_of(label, middles):
    return label(middles) if callable(label) else np.full(len(middles), label)


class Boolean(Part):
    """Exact booleans of meshes (manifold3d): sharp creases, every triangle knows where it comes from."""

    def mesh(self):
        owners, total = {}, {+1: Manifold(), -1: Manifold()}
        for sign, label, solid in self.solids:
            solid = solid.as_original()
            owners[solid.original_id()] = label
            total[sign] = total[sign] + solid
        mesh = (total[+1] - total[-1]).to_mesh()
        verts, tris = np.array(mesh.vert_properties)[:, :3].astype(float), np.array(mesh.tri_verts)
        middles, labels = verts[tris].mean(axis=1), np.full(len(tris), -1)
        runs = np.array(mesh.run_index) // 3
        for begin, end, owner in zip(runs, runs[1:], mesh.run_original_id):
            labels[begin:end] = label_of(owners[owner], middles[begin:end])
        return verts, tris, labels


# --- solids for booleans


def box(low, high):
    """Box between two corners."""
    low, high = np.minimum(low, high), np.maximum(low, high)
    return Manifold.cube(list(high - low)).translate(list(low))


def rod(start, end, radius, top=None, segments=32):
    """Cylinder or cone between two points."""
    start, end = np.array(start, float), np.array(end, float)
    axis = end - start
    length = np.linalg.norm(axis)
    solid = Manifold.cylinder(length, radius, radius if top is None else top, segments)
    tilt = math.degrees(math.acos(max(-1, min(1, axis[2] / length))))
    turn = math.degrees(math.atan2(axis[1], axis[0]))
    return solid.rotate([0, tilt, 0]).rotate([0, 0, turn]).translate(list(start))


def plate(outline, height, foot=0.0, **more):
    """Outline (or several, holes run the other way) drawn up along z."""
    outlines = outline if isinstance(outline[0][0], (list, tuple, np.ndarray)) else [outline]
    section = CrossSection([np.array(o, float) for o in outlines], manifold3d.FillRule.EvenOdd)
    return section.extrude(height, **more).translate([0, 0, foot])


def turn(solid, degrees, about='z'):
    return solid.rotate([degrees if about == a else 0 for a in 'xyz'])


def arc(radius, begin, end, steps):
    """Points of an arc, degrees."""
    angles = np.radians(np.linspace(begin, end, steps + 1))
    return [(radius * math.cos(a), radius * math.sin(a)) for a in angles]


def bent(radius, thickness, begin, end, height, foot=0.0, steps=24):
    """Wall along an arc."""
    ring = arc(radius + thickness / 2, begin, end, steps) + arc(radius - thickness / 2, end, begin, steps)
    return plate(ring, height, foot)


def swept(path, radius, segments=16):
    """Round wire along a path of points, closed at its ends."""
    path = np.array(path, float)
    along = np.gradient(path, axis=0)
    along /= np.linalg.norm(along, axis=1)[:, None]
    side = np.cross(along[0], [0.3, 0.2, 1.0])
    angles = 2 * math.pi * np.arange(segments) / segments
    verts = []
    for point, t in zip(path, along):
        side = side - t * (side @ t)
        side /= np.linalg.norm(side)
        up = np.cross(t, side)
        verts += [point + radius * (math.cos(a) * side + math.sin(a) * up) for a in angles]
    last, tris = len(path) - 1, []
    for i in range(last):
        for j in range(segments):
            a, b = i * segments + j, i * segments + (j + 1) % segments
            tris += [(a, b, b + segments), (a, b + segments, a + segments)]
    for j in range(1, segments - 1):
        tris += [(0, j + 1, j), (last * segments, last * segments + j, last * segments + j + 1)]
    return Manifold(manifold3d.Mesh(np.array(verts, np.float32), np.array(tris, np.uint32)))


class Implicit(Part):
    """Distance functions joined smoothly and meshed by marching cubes: no crease anywhere."""

    def __init__(self, blend, cell, tolerance):
        super().__init__()
        self.blend, self.cell, self.tolerance = blend, cell, tolerance

    def values(self, points):
        """Joined value, and label (-1 where it differs from that of the nearest primitive)."""
        each = np.array([solid(points) for _, _, solid in self.solids])
        total = each[0]
        for one in each[1:]:
            h = np.maximum(self.blend - np.abs(total - one), 0) / self.blend
            total = np.minimum(total, one) - h * h * self.blend / 4
        label = np.array([label for _, label, _ in self.solids])[each.argmin(axis=0)]
        return total, np.where(each.min(axis=0) - total > 0.02 * self.blend, -1, label)

    def mesh(self):
        from skimage.measure import marching_cubes

        low, high = self.bounds
        low, high = np.array(low) - 2 * self.cell, np.array(high) + 2 * self.cell
        axes = [np.arange(a, b, self.cell) for a, b in zip(low, high)]
        grid = np.stack(np.meshgrid(*axes, indexing='ij'), axis=-1).reshape(-1, 3)
        value = np.concatenate([self.values(g)[0] for g in np.array_split(grid, 16)])
        field = value.reshape([len(a) for a in axes])
        verts, tris, _, _ = marching_cubes(-field, 0.0, spacing=[self.cell] * 3, allow_degenerate=False)
        solid = Manifold(manifold3d.Mesh((verts + low).astype(np.float32), tris.astype(np.uint32)))
        if solid.status() != manifold3d.Error.NoError:
            solid = Manifold(manifold3d.Mesh((verts + low).astype(np.float32), tris[:, ::-1].astype(np.uint32)))
        if solid.volume() < 0:
            solid = Manifold(manifold3d.Mesh((verts + low).astype(np.float32), tris[:, ::-1].copy().astype(np.uint32)))
        mesh = solid.simplify(self.tolerance).to_mesh()
        verts, tris = np.array(mesh.vert_properties)[:, :3].astype(float), np.array(mesh.tri_verts)
        return verts, tris, self.values(verts[tris].mean(axis=1))[1]


def capsule(points, radii):
    """Distance to a row of round cones."""
    points, radii = np.array(points, float), np.broadcast_to(radii, len(points))

    def distance(p):
        best = np.full(len(p), np.inf)
        for a, b, ra, rb in zip(points, points[1:], radii, radii[1:]):
            t = np.clip((p - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
            d = np.linalg.norm(p - a - t[:, None] * (b - a), axis=1) - (ra + t * (rb - ra))
            best = np.minimum(best, d)
        return best

    return distance


def block(middle, half, rounding):
    """Distance to a box with rounded edges."""
    middle, half = np.array(middle, float), np.array(half, float) - rounding

    def distance(p):
        q = np.abs(p - middle) - half
        return np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(axis=1), 0) - rounding

    return distance

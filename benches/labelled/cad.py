"""Parts of a CAD kernel (OpenCASCADE by cadquery): fillets, tessellated face by face."""
import numpy as np
from cadquery import Compound, Vertex, Workplane
from OCP.BRep import BRep_Tool
from OCP.BRepExtrema import BRepExtrema_DistShapeShape
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.TopAbs import TopAbs_Orientation
from OCP.TopLoc import TopLoc_Location

from solids import Part, label_of

NEAR = 1e-4  # mm: a point lies on the surface of a solid


def away(skin, point):
    """Distance of a point to the surface of a solid."""
    return BRepExtrema_DistShapeShape(skin.wrapped, Vertex.makeVertex(*point).wrapped).Value()


def skin_of(solid):
    shells = Compound.makeCompound(solid.val().Shells())
    return shells, shells.BoundingBox(tolerance=NEAR)


class Cad(Part):
    """Solids of a CAD kernel, joined; edges where two of different features meet inward are rounded."""

    def __init__(self, deviation, angle=0.3, fillet=0.0, clean=True):
        super().__init__()
        self.deviation, self.angle, self.fillet, self.clean = deviation, angle, fillet, clean

    def joined(self):
        whole = None
        for sign in (+1, -1):
            for s, _, solid in self.solids:
                if s == sign:
                    whole = solid if whole is None else (whole.union(solid) if s > 0 else whole.cut(solid))
        return whole.clean() if self.clean else whole

    def rounded(self, whole, skins):
        """Rounds the edges that lie on two features' surfaces, as many together as the kernel will."""
        edges = []
        for edge in whole.edges().vals():
            ends = [edge.positionAt(t).toTuple() for t in (0.25, 0.6)]
            owners = {l for s, l, (k, b) in skins if s > 0 and all(inside(b, p) and away(k, p) < NEAR for p in ends)}
            if len(owners) > 1 and self.concave(whole, edge):
                edges.append(edge)
        for radius in (self.fillet, self.fillet / 2):
            try:
                done = whole.newObject(edges).fillet(radius)
                if done.val().isValid():
                    return done
            except Exception:  # the kernel gives up in many ways
                continue
        return whole

    @staticmethod
    def concave(whole, edge):
        """Whether material fills more than half of a small ball about the edge's middle."""
        import cadquery as cq

        middle, r = edge.positionAt(0.43).toTuple(), 0.05
        ball = cq.Workplane().sphere(r).translate(middle)
        return whole.intersect(ball).val().Volume() > 0.6 * 4.18879 * r**3

    def mesh(self):
        skins = [(s, l, skin_of(solid)) for s, l, solid in self.solids]
        whole = self.joined()
        if self.fillet:
            whole = self.rounded(whole, skins)
        shape = whole.val()
        BRepMesh_IncrementalMesh(shape.wrapped, self.deviation, False, self.angle, False)
        verts, tris, labels = [], [], []
        for face in shape.Faces():
            points, corners, middles = triangles(face)
            tris += [[len(verts) + i for i in t] for t in corners]
            verts += points
            labels += self.labels(skins, middles)
        return np.array(verts), np.array(tris), np.array(labels)

    @staticmethod
    def labels(skins, middles):
        """Of each point the feature of the first solid on whose surface it lies; first where it was the last time."""
        out, order = [], list(range(len(skins)))
        for p in middles:
            found = -1
            for i in order:
                _, label, (skin, bounds) = skins[i]
                if inside(bounds, p) and away(skin, p) < NEAR:
                    found = int(label_of(label, np.array([p]))[0])
                    break
            out.append(found)
        return out


def inside(b, p):
    e = 10 * NEAR
    return b.xmin - e <= p[0] <= b.xmax + e and b.ymin - e <= p[1] <= b.ymax + e and b.zmin - e <= p[2] <= b.zmax + e


def triangles(face):
    """Vertices, triangles (outward) and a point of the true surface in the middle of each triangle."""
    place = TopLoc_Location()
    mesh = BRep_Tool.Triangulation_s(face.wrapped, place)
    move = place.Transformation()
    surface = BRep_Tool.Surface_s(face.wrapped)
    points, uv = [], []
    for i in range(1, mesh.NbNodes() + 1):
        p = mesh.Node(i).Transformed(move)
        points.append((p.X(), p.Y(), p.Z()))
        uv.append((mesh.UVNode(i).X(), mesh.UVNode(i).Y()))
    flip = face.wrapped.Orientation() == TopAbs_Orientation.TopAbs_REVERSED
    corners, middles = [], []
    for i in range(1, mesh.NbTriangles() + 1):
        a, b, c = mesh.Triangle(i).Get()
        corners.append((a - 1, c - 1, b - 1) if flip else (a - 1, b - 1, c - 1))
        u, v = np.mean([uv[a - 1], uv[b - 1], uv[c - 1]], axis=0)
        p = surface.Value(u, v)
        middles.append((p.X(), p.Y(), p.Z()))
    return points, corners, middles


def brick(low, high):
    """Box between two corners."""
    low, high = np.minimum(low, high), np.maximum(low, high)
    size = high - low
    return Workplane().box(*size, centered=False).translate(tuple(low))


def pole(start, end, radius):
    """Cylinder between two points."""
    start, end = np.array(start, float), np.array(end, float)
    from cadquery import Solid, Vector

    axis = end - start
    length = float(np.linalg.norm(axis))
    return Workplane(Solid.makeCylinder(radius, length, Vector(*start), Vector(*(axis / length))))


def drawn(outline, height, foot=0.0):
    """Outline drawn up along z."""
    return Workplane('XY', origin=(0, 0, foot)).polyline([tuple(p) for p in outline]).close().extrude(height)

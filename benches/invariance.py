"""Are the features of a part the same, however it lies, is numbered, scaled or tessellated?

    python invariance.py armesh-check folder/of/stl [parts]
    python invariance.py --make folder        seven parts at three tolerances each (needs cadquery)

Each part is compared with copies of itself: turned and moved, ten times as large, with its faces in another order. Files
NAME_0.stl, NAME_1.stl ... are one part at different tolerances: all are compared with the one of the most faces. A feature
is found again if one of the other copy covers it with an IoU of at least 0.5, by points spread over both surfaces; a
finding is a feature at a ratio of 5 or more. Only features of a hundredth of the area or more, and findings, count. Needs
numpy.
"""

import json
import pathlib
import re
import subprocess
import sys
import tempfile

import numpy as np

POINTS = 6000
LEAST = 0.01
FINDING = 5.0
FACET = np.dtype([("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")])


def read(path):
    data = path.read_bytes()
    count = int(np.frombuffer(data, "<u4", 1, 80)[0])
    return np.frombuffer(data, FACET, count, 84)["v"].astype(float)


def write(path, faces):
    record = np.zeros(len(faces), FACET)
    record["v"] = faces
    path.write_bytes(bytes(80) + np.uint32(len(faces)).tobytes() + record.tobytes())


def spread(faces, labels, random):
    """Points over the surface with their normals and labels."""
    area = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    size = np.linalg.norm(area, axis=1)
    face = random.choice(len(faces), POINTS, p=size / size.sum())
    u, v = random.random((2, POINTS, 1))
    over = u + v > 1
    u, v = np.where(over, 1 - u, u), np.where(over, 1 - v, v)
    corner = faces[face]
    at = corner[:, 0] + u * (corner[:, 1] - corner[:, 0]) + v * (corner[:, 2] - corner[:, 0])
    return at, area[face] / size[face, None], labels[face]


def carried(points, onto):
    """Labels of the nearest points of another copy that face the same way."""
    size = np.ptp(onto[0], axis=0).max()
    out = np.empty(len(points[0]), int)
    for first in range(0, len(out), 500):
        part = slice(first, first + 500)
        gap = ((points[0][part, None] - onto[0][None]) ** 2).sum(2)
        gap += size**2 * (points[1][part] @ onto[1].T < 0.5)
        out[part] = onto[2][gap.argmin(1)]
    return out


def run(check, faces):
    with tempfile.TemporaryDirectory() as folder:
        part, report = pathlib.Path(folder) / "part.stl", pathlib.Path(folder) / "report.json"
        write(part, faces)
        subprocess.run([check, str(part), "--json", str(report), "--quiet"], check=False)
        out = json.loads(report.read_text())
    ratio = {f["id"]: f["ratio"] or 0.0 for f in out["features"]}
    return np.array(out["face_feature"]), ratio


def compare(first, second):
    """Of what counts in the first: how many features, found again, findings, found again, and how ratios differ."""
    (points, ratio), (onto, other) = first, second
    there = carried(points, onto)
    rows = []
    for k, own in ratio.items():
        mine = points[2] == k
        if mine.mean() < LEAST and (own < FINDING or mine.sum() < 20):
            continue
        hits = [(np.mean(mine & (there == q)) / np.mean(mine | (there == q)), q) for q in set(there[mine])]
        best = max(hits, default=(0.0, -1))
        rows.append((own, best[0] >= 0.5, abs(other.get(best[1], 0.0) / max(own, 1e-9) - 1)))
    return rows


def summary(name, rows):
    findings = [r for r in rows if r[0] >= FINDING]
    off = [r[2] for r in rows if r[1]] or [float("nan")]
    found = max((r[2] for r in findings if r[1]), default=float("nan"))
    again = sum(r[1] for r in rows), sum(r[1] for r in findings)
    print(f"{name:32} features {again[0]}/{len(rows)}  findings {again[1]}/{len(findings)}  "
          f"ratio off: median {np.median(off):.4f}, 95 % {np.percentile(off, 95):.4f}, worst {max(off):.4f}, "
          f"worst of findings {found:.4f}", flush=True)


def main(check, folder, only):
    random = np.random.default_rng(1)
    turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    groups, all_rows = {}, {}
    for path in sorted(pathlib.Path(folder).glob("*.stl")):
        if not only or any(word in path.stem for word in only):
            groups.setdefault(re.sub(r"_\d+$", "", path.stem), []).append(path)
    for name, paths in groups.items():
        paths.sort(key=lambda p: -p.stat().st_size)
        faces = read(paths[0])
        labels, ratio = run(check, faces)
        own = spread(faces, labels, random), ratio
        order = random.permutation(len(faces))
        size = np.ptp(faces.reshape(-1, 3), axis=0).max()
        back = lambda f: (f - 0.3 * size) @ turn
        copies = [
            ("turned", faces @ turn.T + 0.3 * size, back),
            ("scaled", 10 * faces, lambda f: f / 10),
            ("renumbered", np.take_along_axis(faces[order], (np.arange(3) + order[:, None])[..., None] % 3, 1), None),
        ]
        copies += [(f"tessellated ({len(read(p))} for {len(faces)})", read(p), None) for p in paths[1:]]
        for kind, copy, undo in copies:
            labels, ratio = run(check, copy)
            copy = undo(copy) if undo else copy
            other = spread(copy, labels, random), ratio
            rows = compare(own, other) + compare(other, own)
            all_rows.setdefault(kind.split(" ")[0], []).extend(rows)
            summary(f"{name} {kind}", rows)
    print()
    for kind, rows in all_rows.items():
        summary(f"all {kind}", rows)


def make(folder):
    import cadquery as cq

    plate = cq.Workplane("XY").box(60, 40, 8)
    top = plate.faces(">Z").workplane()

    def foot(solid, radius):
        edge = lambda e: abs(e.BoundingBox().zmin - 4) < 1e-6 and abs(e.BoundingBox().zmax - 4) < 1e-6
        inner = lambda e: max(abs(e.BoundingBox().xmax), abs(e.BoundingBox().xmin)) < 29.9
        edges = [e for e in solid.edges().vals() if edge(e) and inner(e)]
        return cq.Workplane(solid.val().fillet(radius, edges))

    parts = {
        "pins": foot(top.pushPoints([(-18, 0), (0, 5), (18, -6)]).circle(1.5).extrude(18), 1.5),
        "tube": foot(top.circle(6).circle(4.8).extrude(16), 1.5),
        "rib": foot(top.rect(1.6, 26).extrude(14), 1.2),
        "boss": foot(top.circle(7).extrude(5).faces(">Z").workplane().circle(1.5).extrude(14), 1.0),
        "cone": foot(top.circle(5).workplane(offset=16).circle(1.5).loft(combine=True), 1.0),
        "angle": cq.Workplane("XZ").polyline([(0, 0), (40, 0), (40, 3), (3, 3), (3, 30), (0, 30)]).close().extrude(30)
        .edges("|Y").edges(cq.NearestToPointSelector((3, -15, 3))).fillet(2.0),
        "bent": cq.Workplane("XZ").polyline([(0, 0), (40, 0), (40, 3), (3, 3), (3, 30), (0, 30)]).close().extrude(30)
        .edges("|Y").edges(cq.NearestToPointSelector((3, -15, 3))).fillet(3.0)
        .edges("|Y").edges(cq.NearestToPointSelector((0, -15, 0))).fillet(6.0),
    }
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for name, part in parts.items():
        for k, tolerance in enumerate((0.2, 0.05, 0.01)):
            cq.exporters.export(part, str(folder / f"{name}_{k}.stl"), tolerance=tolerance, angularTolerance=0.6 - 0.2 * k)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--make"] and len(sys.argv) == 3:
        make(sys.argv[2])
    elif len(sys.argv) >= 3:
        main(sys.argv[1], sys.argv[2], sys.argv[3:])
    else:
        sys.exit(__doc__)

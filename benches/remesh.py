"""Do the wall width and D1 depend on how the surface is cut into triangles?

    python remesh.py armesh-check folder/of/stl [parts]

For each part three copies of the same surface are made: every triangle cut in four, four times over (or until there are
MOST faces); the longest edges cut until none is longer than a 40th of the part; and edges of flat regions flipped at
random after that. The wall width and D1 of each copy at the vertices of the part are held against the part's own. Needs
numpy.
"""

import csv
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

MOST = 60_000


def read_stl(path):
    data = path.read_bytes()
    if data[:5] == b"solid" and b"facet" in data[:400]:
        xyz = [line.split()[1:4] for line in data.decode(errors="replace").splitlines() if line.strip().startswith("vertex")]
        soup = np.array(xyz, dtype=np.float32).reshape(-1, 3, 3)
    else:
        record = np.dtype([("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")])
        soup = np.frombuffer(data, dtype=record, offset=84)["v"]
    points, index = np.unique(soup.reshape(-1, 3) + np.float32(0), axis=0, return_inverse=True)
    faces = index.reshape(-1, 3)
    whole = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    return points.astype(np.float64), faces[whole]


def write_ply(path, points, faces):
    """Double precision: a copy must lie on the surface."""
    with open(path, "wb") as out:
        head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n"
        head += "property double x\nproperty double y\nproperty double z\n"
        head += f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
        out.write(head.encode())
        out.write(points.astype("<f8").tobytes())
        rows = np.empty(len(faces), dtype=[("n", "u1"), ("v", "<i4", 3)])
        rows["n"], rows["v"] = 3, faces
        out.write(rows.tobytes())


def cut_in_four(points, faces):
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    unique, index = np.unique(edges, axis=0, return_inverse=True)
    ab, bc, ca = (index.reshape(-1, 3) + len(points)).T
    a, b, c = faces.T
    cut = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    return np.vstack([points, points[unique].mean(axis=1)]), np.vstack([np.stack(t, axis=1) for t in cut])


def cut_long_edges(points, faces, longest):
    """Bisects the longest edge of each triangle in turn, all triangles around it alike, until none is too long."""
    while len(faces) < MOST:
        ends = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 3, 2)
        length = np.linalg.norm(points[ends[:, :, 0]] - points[ends[:, :, 1]], axis=2)
        keys = np.sort(ends, axis=2)
        unique, index = np.unique(keys.reshape(-1, 2), axis=0, return_inverse=True)
        index = index.reshape(-1, 3)
        own = index[np.arange(len(faces)), length.argmax(axis=1)]
        # An edge is cut if it is too long and the longest of every triangle around it.
        size = np.linalg.norm(points[unique[:, 0]] - points[unique[:, 1]], axis=1)
        longer = np.zeros(len(unique), bool)
        np.logical_or.at(longer, index.ravel(), (index != own[:, None]).ravel())
        chosen = (size > longest) & ~longer
        if not chosen.any():
            # Equal lengths, or chains of ever longer ones: take what is longest for any one triangle.
            rest = np.unique(own[length.max(axis=1) > longest])
            if not len(rest):
                break
            chosen[rest[size[rest].argmax()]] = True
        middle = np.cumsum(chosen) - 1 + len(points)
        points = np.vstack([points, points[unique[chosen]].mean(axis=1)])
        hit = chosen[index]
        cut = hit.any(axis=1)
        k = hit.argmax(axis=1)[cut]
        row = np.flatnonzero(cut)
        a, b, c = faces[row, k], faces[row, (k + 1) % 3], faces[row, (k + 2) % 3]
        m = middle[index[row, k]]
        faces = np.vstack([faces[~cut], np.stack([a, m, c], 1), np.stack([m, b, c], 1)])
    return points, faces


def flip_flat_edges(points, faces, rng, rounds=3):
    """Flips edges between two triangles in one plane that make a convex quadrilateral, each triangle once a round."""
    faces = faces.copy()
    for _ in range(rounds):
        half = {}
        for f, t in enumerate(faces):
            for k in range(3):
                half.setdefault((t[k], t[(k + 1) % 3]), []).append((f, k))
        normal = np.cross(points[faces[:, 1]] - points[faces[:, 0]], points[faces[:, 2]] - points[faces[:, 0]])
        area = np.linalg.norm(normal, axis=1)
        used = np.zeros(len(faces), bool)
        edges = [e for e in half if e[0] < e[1]]
        rng.shuffle(edges)
        for a, b in map(tuple, edges):
            here, there = half[(a, b)], half.get((b, a), [])
            if len(here) != 1 or len(there) != 1:
                continue
            (f, k), (g, l) = here[0], there[0]
            c, d = faces[f][(k + 2) % 3], faces[g][(l + 2) % 3]
            if used[f] or used[g] or c == d or (c, d) in half or (d, c) in half or area[f] * area[g] == 0:
                continue
            n, m = normal[f] / area[f], normal[g] / area[g]
            if n @ m < 1 - 1e-12 or abs((points[d] - points[a]) @ n) > 1e-9 * np.abs(points).max():
                continue
            new = [np.cross(points[d] - points[a], points[c] - points[a]) @ n,
                   np.cross(points[c] - points[b], points[d] - points[b]) @ n]
            if min(new) < 0.05 * (area[f] + area[g]):
                continue
            faces[f], faces[g] = (a, d, c), (b, c, d)
            half[(c, d)] = [(f, 0)]
            used[f] = used[g] = True
    return faces


def values(check, path, folder):
    """By position: wall width, D1."""
    out = folder / "v.csv"
    command = [check, str(path), "--vertex-csv", str(out)]
    done = subprocess.run(command, capture_output=True, text=True)
    if not out.exists():
        raise SystemExit(f"{' '.join(command)}\n{done.stderr}")
    with open(out, newline="") as rows:
        both = {(r["x"], r["y"], r["z"]): [float(r[k] or "nan") for k in ("d2", "d1")] for r in csv.DictReader(rows)}
    out.unlink()
    return {tuple(np.float32(p).tolist()): v for p, v in both.items()}


def compare(before, after, k):
    both = [(d[k], after[p][k]) for p, d in before.items() if p in after and d[k] > 0 and not np.isnan(after[p][k])]
    a, b = np.array(both).T
    change = np.abs(b / a - 1) * 100
    return np.median(change), np.percentile(change, 95), change.max()


def main():
    check, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    paths = sorted(folder.glob("*.stl"))[: int(sys.argv[3]) if len(sys.argv) > 3 else None]
    print(f"{'change at the vertices, %':32}{'cut in four':>22}{'long edges cut':>22}{'and flipped':>22}")
    print(f"{'':32}" + f"{'median':>8}{'p95':>6}{'most':>8}" * 3)
    for path in paths:
        points, faces = read_stl(path)
        copies = [(points, faces)]
        fine = (points, faces)
        for _ in range(4):
            if 4 * len(fine[1]) <= MOST:
                fine = cut_in_four(*fine)
        copies.append(fine)
        even = cut_long_edges(points, faces, np.ptp(points, axis=0).max() / 40)
        copies.append(even)
        copies.append((even[0], flip_flat_edges(*even, np.random.default_rng(1))))
        with tempfile.TemporaryDirectory() as scratch:
            scratch = pathlib.Path(scratch)
            found = []
            for copy in copies:
                write_ply(scratch / "copy.ply", *copy)
                found.append(values(check, scratch / "copy.ply", scratch))
        for k, what in enumerate(("width", "D1")):
            row = "".join("{:8.2f}{:6.1f}{:8.1f}".format(*compare(found[0], after, k)) for after in found[1:])
            print(f"{path.stem[:25]:26}{what:6}{row}", flush=True)


if __name__ == "__main__":
    main()

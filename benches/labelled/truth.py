"""What is known of a part by its construction, and how it is written down.

A part is NAME.stl (binary) and NAME.json:
  family        which kind of part this is
  face_feature  one label per triangle in file order, -1 = transition (a fillet, a node), not scored
  features      [{kind, small, long, expected_ratio}] by label; lengths in the unit of the part (mm)
expected_ratio is the longest exact geodesic on the feature's own triangles (`long`) over its known smallest
dimension (`small`), the largest diameter of a tapered pin.
"""
import json
import struct

import numpy as np
import pygeodesic.geodesic as geodesic

FEW = 80  # vertices: up to so many, every one is a source
ROUNDS = 14  # of going on from the farthest vertex that was not yet a source


class Sets:
    """Union-find."""

    def __init__(self, n):
        self.parent = list(range(n))

    def root(self, i):
        while self.parent[i] != i:
            self.parent[i] = self.parent[self.parent[i]]
            i = self.parent[i]
        return i

    def join(self, a, b):
        self.parent[self.root(a)] = self.root(b)


def pieces(verts, tris):
    """Surfaces that hang together by edges; a vertex where sheets only touch is one of each (the solver needs it)."""
    edges = {}
    for t, corners in enumerate(tris):
        for k in range(3):
            a, b = int(corners[k]), int(corners[(k + 1) % 3])
            edges.setdefault((min(a, b), max(a, b)), []).append((t, k, a < b))
    fans, sheets = Sets(3 * len(tris)), Sets(len(tris))
    for users in edges.values():
        if len(users) == 2 and users[0][2] != users[1][2]:
            (t, k, _), (s, j, _) = users
            sheets.join(t, s)
            fans.join(3 * t + k, 3 * s + (j + 1) % 3)
            fans.join(3 * t + (k + 1) % 3, 3 * s + j)
    corner = np.array([fans.root(i) for i in range(3 * len(tris))])
    sheet = np.array([sheets.root(i) for i in range(len(tris))])
    for one in np.unique(sheet):
        used, local = np.unique(corner.reshape(-1, 3)[sheet == one], return_inverse=True)
        yield verts[tris.reshape(-1)[used]], local.reshape(-1, 3)


def longest_on(verts, tris):
    """Longest exact geodesic between two vertices of a connected piece of surface."""
    solver = geodesic.PyGeodesicAlgorithmExact(verts, tris)

    def from_vertex(i):
        return solver.geodesicDistances(np.array([i]), None)[0]

    if len(verts) <= FEW:
        return max(from_vertex(i)[np.isfinite(from_vertex(i))].max() for i in range(len(verts)))
    axes = np.array([(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if x or y or z], float)
    sources = list(dict.fromkeys(int(i) for i in np.argmax(verts @ axes.T, axis=0)))[:10]
    farness, longest, tried = np.zeros(len(verts)), 0.0, set()
    for _ in range(len(sources) + ROUNDS):
        i = sources.pop() if sources else int(np.argmax(farness))
        if i in tried:
            break
        tried.add(i)
        d = from_vertex(i)
        d = np.where(np.isfinite(d) & (d < 1e9), d, 0.0)
        longest = max(longest, d.max())
        farness = np.maximum(farness, d)
        farness[list(tried)] = 0.0
    return longest


def longest(verts, tris):
    """D1max of a feature: that of its longest piece, where it is in several."""
    return max(longest_on(v, t) for v, t in pieces(verts, tris))


def write(folder, name, family, features, verts, tris, labels):
    """Writes NAME.stl and NAME.json; features that no triangle has are left out."""
    verts = np.asarray(verts, np.float32).astype(float)
    _, first, back = np.unique(verts, axis=0, return_index=True, return_inverse=True)
    verts, tris = verts[first], back.reshape(-1)[np.asarray(tris)]
    keep = (tris[:, 0] != tris[:, 1]) & (tris[:, 1] != tris[:, 2]) & (tris[:, 2] != tris[:, 0])
    tris, labels = tris[keep], np.asarray(labels)[keep]
    out, renumber = [], {-1: -1}
    for k, (kind, small) in enumerate(features):
        mine = tris[labels == k]
        if not len(mine):
            continue
        renumber[k] = len(out)
        length = float(longest(verts, mine))
        out.append(dict(kind=kind, small=small, long=length, expected_ratio=length / small))
    labels = [renumber[int(k)] for k in labels]
    corners = verts[tris].astype('<f4')
    record = np.zeros(len(tris), np.dtype([('n', '<f4', 3), ('v', '<f4', (3, 3)), ('a', '<u2')]))
    record['v'] = corners
    (folder / f'{name}.stl').write_bytes(bytes(80) + struct.pack('<I', len(tris)) + record.tobytes())
    (folder / f'{name}.json').write_text(json.dumps(dict(family=family, face_feature=labels, features=out)))
    return out

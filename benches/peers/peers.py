#!/usr/bin/env python3
"""Runs armesh and its peers on the same meshes and prints a table. Started by run.sh: peers.py PROGRAM"""
import importlib.metadata
import multiprocessing
import os
import pathlib
import platform
import subprocess
import sys
import tempfile
import time

import numpy as np
import potpourri3d

PROGRAM = sys.argv[1]
PROCESSES = 2
D1_SIZE = 32   # 10 N^2 + 2 = 10 242 vertices
D2_SIZE = 71   # 20 N^2 = 100 820 faces
ORGANIC_SIZE = 71     # 10 N^2 + 2 = 50 412 vertices
ORGANIC_SOURCES = 200 # of all, which would take minutes
RAYS, CGAL_RAYS = 20, 25


def ours(*args):
    out = subprocess.run([PROGRAM, *map(str, args)], check=True, capture_output=True, text=True).stdout
    return [float(x) for x in out.split()]


def read_mesh(path):
    data = path.read_bytes()
    vertices, faces = np.frombuffer(data, dtype='<u8', count=2)
    points = np.frombuffer(data, dtype='<f8', offset=16, count=3 * int(vertices)).reshape(-1, 3)
    triangles = np.frombuffer(data, dtype='<u4', offset=16 + points.nbytes).reshape(int(faces), 3)
    return points.copy(), triangles.astype(np.int64)


def loop(points, triangles, sources, ready, done):
    """D1 of some vertices."""
    ready.wait()
    processor = time.process_time()
    solver = potpourri3d.MeshHeatMethodDistanceSolver(points, triangles)
    greatest = max((solver.compute_distance(v).max() for v in sources), default=0)
    done.put((greatest, time.process_time() - processor))


def geometry_central(points, triangles, sources):
    ready, done = multiprocessing.Barrier(PROCESSES + 1), multiprocessing.Queue()
    workers = [multiprocessing.Process(target=loop, args=(points, triangles, sources[k::PROCESSES], ready, done))
               for k in range(PROCESSES)]
    for w in workers:
        w.start()
    ready.wait()
    start = time.perf_counter()
    results = [done.get() for _ in workers]
    seconds = time.perf_counter() - start
    for w in workers:
        w.join()
    return seconds, sum(r[1] for r in results), max(r[0] for r in results)


def row(name, wall, processor, more=''):
    print(f'  {name:34s}{wall:9.2f} s {processor:9.2f} s   {more}'.rstrip())


def quicker(peer, mine, cores=1):
    """How many times faster, by the clock and by processor time; `cores`: the peer ran on one, allow it that many."""
    return f'{peer[0] / cores / mine[0]:.1f} times faster, {peer[1] / mine[1]:.1f} by processor time'


def organic():
    """D1 of a larger, bumpy mesh: the peer's loop is extrapolated from some of the sources."""
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / 'mesh'
        subprocess.run([PROGRAM, 'organic', str(ORGANIC_SIZE), str(path)], check=True)
        points, triangles = read_mesh(path)
    print(f'\nD1 of all {len(points)} vertices of a bumpy ellipsoid ({len(triangles)} faces)      wall    processor')
    before = ours('organic-d1', ORGANIC_SIZE, PROCESSES)
    prepared = geometry_central(points, triangles, [])
    some = geometry_central(points, triangles, range(0, len(points), len(points) // ORGANIC_SOURCES))
    after = ours('organic-d1', ORGANIC_SIZE, PROCESSES)
    count = len(range(0, len(points), len(points) // ORGANIC_SOURCES))
    peer = [p + (s - p) * len(points) / count for p, s in zip(prepared[:2], some[:2])]
    mine = max(before, after)
    row(f'geometry-central, {PROCESSES} processes, from {count}', *peer, f'D1max {some[2]:.4f} of these')
    row(f'armesh, {mine[3]:.0f} sources (to 5 %)', *mine[:2], f'D1max {mine[2]:.4f}   {quicker(peer, mine)}')


def main():
    print(f'{platform.machine()}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f} before the start, '
          f'potpourri3d {importlib.metadata.version("potpourri3d")}')
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / 'mesh'
        subprocess.run([PROGRAM, 'mesh', str(D1_SIZE), str(path)], check=True)
        points, triangles = read_mesh(path)

    print(f'\nD1 of all {len(points)} vertices of an ellipsoid ({len(triangles)} faces)      wall    processor')
    before = ours('d1', D1_SIZE, PROCESSES)
    peer = geometry_central(points, triangles, range(len(points)))
    after = ours('d1', D1_SIZE, PROCESSES)
    certified = ours('certified', D1_SIZE, PROCESSES)
    mine = max(before, after)  # the slower of two, before and after
    row(f'geometry-central, {PROCESSES} processes', *peer[:2], f'D1max {peer[2]:.4f}')
    row('armesh, one source a vertex, and D2', *mine[:2], f'D1max {mine[2]:.4f}   {quicker(peer, mine)}')
    row(f'armesh, {certified[3]:.0f} sources (to 2 %), and D2', *certified[:2],
        f'D1max {certified[2]:.4f}   {quicker(peer, certified)}')

    organic()

    print(f'\nD2 of {20 * D2_SIZE ** 2} faces of an ellipsoid                    wall    processor')
    both_before = ours('d2', D2_SIZE, PROCESSES, RAYS)
    one = ours('d2', D2_SIZE, 1, RAYS)
    cgal = ours('cgal-sdf', D2_SIZE, CGAL_RAYS)
    both = max(both_before, ours('d2', D2_SIZE, PROCESSES, RAYS))
    row(f'CGAL sdf_values, {CGAL_RAYS} rays, 1 core', *cgal)
    row(f'armesh, {RAYS} rays, 1 thread', *one, quicker(cgal, one))
    row(f'armesh, {RAYS} rays, {PROCESSES} threads', *both, quicker(cgal, both))
    print(f'  (were CGAL perfectly parallel on {PROCESSES} cores: {quicker(cgal, both, PROCESSES)})')


if __name__ == '__main__':
    multiprocessing.set_start_method('spawn')  # no solver state shared with the parent
    main()

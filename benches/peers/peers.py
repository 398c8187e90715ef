#!/usr/bin/env python3
"""Runs armesh and its peers on the same meshes and prints a table. Started by run.sh: peers.py PROGRAM"""
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


def loop(points, triangles, first, ready, done):
    """D1 of every PROCESSES-th vertex, from `first`."""
    ready.wait()
    solver = potpourri3d.MeshHeatMethodDistanceSolver(points, triangles)
    greatest = max(solver.compute_distance(v).max() for v in range(first, len(points), PROCESSES))
    done.put(greatest)


def geometry_central(points, triangles):
    ready, done = multiprocessing.Barrier(PROCESSES + 1), multiprocessing.Queue()
    workers = [multiprocessing.Process(target=loop, args=(points, triangles, k, ready, done)) for k in range(PROCESSES)]
    for w in workers:
        w.start()
    ready.wait()
    start = time.perf_counter()
    greatest = max(done.get() for _ in workers)
    seconds = time.perf_counter() - start
    for w in workers:
        w.join()
    return seconds, greatest


def main():
    print(f'{platform.machine()}, {os.cpu_count()} cores, potpourri3d {potpourri3d.__version__ if hasattr(potpourri3d, "__version__") else ""}'.rstrip(', '))
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / 'mesh'
        subprocess.run([PROGRAM, 'mesh', str(D1_SIZE), str(path)], check=True)
        points, triangles = read_mesh(path)

    print(f'\nD1 of all {len(points)} vertices of an ellipsoid ({len(triangles)} faces), one source each')
    before = ours('d1', D1_SIZE, PROCESSES)
    peer, peer_d1 = geometry_central(points, triangles)
    after = ours('d1', D1_SIZE, PROCESSES)
    mine = max(before[0], after[0])
    print(f'  geometry-central, {PROCESSES} processes     {peer:8.2f} s   D1max {peer_d1:.4f}')
    print(f'  armesh, {PROCESSES} threads, D1 and D2      {mine:8.2f} s   D1max {after[1]:.4f}   (slower of two: {before[0]:.2f}, {after[0]:.2f})')
    print(f'  times faster                    {peer / mine:8.1f}')

    print(f'\nD2 of {20 * D2_SIZE ** 2} faces of an ellipsoid')
    all_before, = ours('d2', D2_SIZE, PROCESSES, RAYS)
    one, = ours('d2', D2_SIZE, 1, RAYS)
    cgal, = ours('cgal-sdf', D2_SIZE, CGAL_RAYS)
    all_after, = ours('d2', D2_SIZE, PROCESSES, RAYS)
    both = max(all_before, all_after)
    print(f'  CGAL sdf_values, {CGAL_RAYS} rays, 1 core   {cgal:8.2f} s')
    print(f'  armesh, {RAYS} rays, 1 thread         {one:8.3f} s   times faster {cgal / one:6.1f}')
    print(f'  armesh, {RAYS} rays, {PROCESSES} threads        {both:8.3f} s   times faster {cgal / both:6.1f}   (half of CGAL\'s time, '
          f'as if on {PROCESSES} cores: {cgal / PROCESSES / both:.1f})')


if __name__ == '__main__':
    multiprocessing.set_start_method('spawn')  # no solver state shared with the parent
    main()

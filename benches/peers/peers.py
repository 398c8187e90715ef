#!/usr/bin/env python3
"""Runs armesh and its peers on the same meshes and prints tables. Started by run.sh:

    peers.py PROGRAMS [--parts FOLDER] [SECTION ...]

PROGRAMS is the folder with `peers`, `embree` and `armesh-check`; without sections all of them run. Both sides of a ratio
run in the same minute, each with two cores: a peer that uses one core runs as two processes, or is credited with half
of its time where it cannot be split (the table says so)."""
import argparse
import importlib.metadata
import math
import multiprocessing
import os
import pathlib
import platform
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np

PROCESSES = 2
D1_SIZES = 32, 48  # 10 N^2 + 2 vertices of an ellipsoid: 10 242 and 23 042
CERTIFIED_SIZE = 71  # 50 412 vertices
EXTRAPOLATED = 200  # sources of the peer's loop where all would take hours
D2_SIZE = 71  # 20 N^2 = 100 820 faces
RAYS, CGAL_RAYS = 20, 25
GROWTH_SIZES = 22, 71, 224, 500  # 9 680 faces to 5 000 000
SLOPE_BAR, BYTES_BAR = 1.1, 1024


class Bench:
    def __init__(self, programs, folder, parts):
        self.programs, self.folder, self.parts = pathlib.Path(programs), pathlib.Path(folder), parts

    def ours(self, *args, program='peers'):
        """Numbers that a program prints."""
        command = [str(self.programs / program), *map(str, args)]
        out = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        return [float(x) for x in out.split()]

    def mesh_file(self, size, shape='mesh'):
        path = self.folder / f'{size}.{shape}'
        if not path.exists():
            self.ours(shape, size, path)
        return path

    def mesh(self, size, shape='mesh'):
        data = self.mesh_file(size, shape).read_bytes()
        vertices, faces = np.frombuffer(data, dtype='<u8', count=2)
        points = np.frombuffer(data, dtype='<f8', offset=16, count=3 * int(vertices)).reshape(-1, 3)
        triangles = np.frombuffer(data, dtype='<u4', offset=16 + points.nbytes).reshape(int(faces), 3)
        return points.copy(), triangles.astype(np.int64)


def table(title, *columns):
    print(f'\n### {title}\n')
    print('| | ' + ' | '.join(columns) + ' |')
    print('|---' * (len(columns) + 1) + '|')


def row(name, *cells):
    print(f'| {name} | ' + ' | '.join(cells) + ' |', flush=True)


def seconds(s):
    return f'{s:.3g} s'


def times(peer, mine):
    return f'{peer / mine:.3g}×'


# --- geometry-central

def loop(points, triangles, sources, ready, done):
    """Distances from each of some vertices."""
    import potpourri3d
    ready.wait()
    start = time.perf_counter()
    solver = potpourri3d.MeshHeatMethodDistanceSolver(points, triangles)
    prepared = time.perf_counter() - start
    greatest = max(solver.compute_distance(int(v)).max() for v in sources)
    done.put((greatest, prepared, time.perf_counter() - start - prepared))


def geometry_central(points, triangles, sources):
    """Seconds for all sources, shared by two processes: preparing, and the loop."""
    ready, done = multiprocessing.Barrier(PROCESSES + 1), multiprocessing.Queue()
    shares = [sources[k::PROCESSES] for k in range(PROCESSES)]
    workers = [multiprocessing.Process(target=loop, args=(points, triangles, s, ready, done)) for s in shares]
    for w in workers:
        w.start()
    ready.wait()
    results = [done.get() for _ in workers]
    for w in workers:
        w.join()
    return max(r[1] for r in results), max(r[2] for r in results), max(r[0] for r in results)


def d1(bench):
    """D1 of all vertices, one source each, in the paper's profile."""
    columns = 'time', 'D1max', 'armesh is faster by'
    for size in D1_SIZES:
        points, triangles = bench.mesh(size)
        table(f'D1 of all {len(points)} vertices of an ellipsoid, one source each', *columns)
        before = bench.ours('d1', size, PROCESSES)
        sources = range(len(points))
        if size != D1_SIZES[0]:
            sources = range(0, len(points), len(points) // 1000)
        prepared, looped, greatest = geometry_central(points, triangles, sources)
        peer = prepared + looped * len(points) / len(sources)
        cgal = bench.ours('cgal-heat', size, 100)
        cgal = (cgal[0] - cgal[2] + cgal[2] / 100 * len(points)) / PROCESSES
        mine = max(before, bench.ours('d1', size, PROCESSES))
        note = '' if len(sources) == len(points) else f', from {len(sources)} sources'
        row(f'geometry-central, {PROCESSES} processes{note}', seconds(peer), f'{greatest:.4f}', times(peer, mine[0]))
        row('CGAL heat method, from 100 sources, half of its time', seconds(cgal), '', times(cgal, mine[0]))
        row('armesh (with D2)', seconds(mine[0]), f'{mine[2]:.4f}', '')


def certified(bench):
    """D1 with a bound of 5 % in the print profile, on a bumpy shape."""
    points, triangles = bench.mesh(CERTIFIED_SIZE, 'organic')
    table(f'D1 to 5 %, {len(points)} vertices of a bumpy ellipsoid', 'time', 'D1max', 'armesh is faster by')
    before = bench.ours('organic-d1', CERTIFIED_SIZE, PROCESSES)
    sources = range(0, len(points), len(points) // EXTRAPOLATED)
    prepared, looped, greatest = geometry_central(points, triangles, sources)
    peer = prepared + looped * len(points) / len(sources)
    mine = max(before, bench.ours('organic-d1', CERTIFIED_SIZE, PROCESSES))
    row(f'geometry-central, {PROCESSES} processes, all sources, from {len(sources)}', seconds(peer),
        f'{greatest:.4f} of these', times(peer, mine[0]))
    row(f'armesh, {mine[3]:.0f} sources', seconds(mine[0]), f'{mine[2]:.4f}', '')


def d2(bench):
    """D2 by rays, wall widths."""
    import meshlib.mrmeshnumpy as meshlib_numpy
    import meshlib.mrmeshpy as meshlib
    points, triangles = bench.mesh(D2_SIZE)
    rays = RAYS * len(triangles)
    table(f'D2, {RAYS} rays a face, {len(triangles)} faces of an ellipsoid (tree included)', 'time', 'rays a second',
          'armesh is faster by')
    for threads in 1, PROCESSES:
        runs = [(bench.ours('d2', D2_SIZE, threads, RAYS)[0],
                 bench.ours(bench.mesh_file(D2_SIZE), threads, RAYS, program='embree')[0]) for _ in range(3)]
        mine, embree = (min(r[k] for r in runs) for k in range(2))
        row(f'Embree 3, single rays, {threads} thread(s)', seconds(embree), f'{rays / embree:.3g}', times(embree, mine))
        row(f'armesh, {threads} thread(s)', seconds(mine), f'{rays / mine:.3g}', '')
    cgal = bench.ours('cgal-sdf', D2_SIZE, CGAL_RAYS)[0]
    row(f'CGAL sdf_values, {CGAL_RAYS} rays, 1 core', seconds(cgal), '', times(cgal, mine))

    table(f'Width at {len(points)} vertices of the ellipsoid', 'time', 'armesh is faster by')
    wall = min(bench.ours('wall', D2_SIZE, PROCESSES)[0] for _ in range(3))
    mesh = meshlib_numpy.meshFromFacesVerts(triangles, points)
    settings = meshlib.InSphereSearchSettings()
    settings.maxRadius = 5.0
    start = time.perf_counter()
    meshlib.computeInSphereThicknessAtVertices(mesh, settings)
    peer = time.perf_counter() - start
    row('MeshLib in-sphere, one sphere a vertex', seconds(peer), '')
    row('armesh wall width, a sphere a vertex and a face', seconds(wall), times(peer, wall))
    row(f'armesh D2, {RAYS} rays a face', seconds(mine), times(peer, mine))


def meshlab(bench):
    """MeshLab's shape diameter function, its own defaults but for the number of rays."""
    import pymeshlab
    points, triangles = bench.mesh(D1_SIZES[1])
    table(f'Shape diameter, {len(triangles)} faces, {RAYS} rays', 'time', 'armesh is faster by')
    mesh = pymeshlab.MeshSet()
    mesh.add_mesh(pymeshlab.Mesh(points, triangles))
    start = time.perf_counter()
    mesh.compute_scalar_by_shape_diameter_function_per_vertex(rays=RAYS)
    peer = time.perf_counter() - start
    mine = bench.ours('d2', D1_SIZES[1], PROCESSES, RAYS)[0]
    row('MeshLab (pymeshlab), rays from vertices', seconds(peer), times(peer, mine))
    row('armesh D2, rays from faces', seconds(mine), '')


def check(bench, part, *options):
    """Wall seconds and peak bytes of a whole check by armesh-check."""
    start = time.perf_counter()
    process = subprocess.Popen([str(bench.programs / 'armesh-check'), str(part), '--quiet', *options],
                               stdout=subprocess.DEVNULL)
    # Its usage as told in the end would include this program's own memory, from before it became another.
    peak = 0
    while process.poll() is None:
        lines = pathlib.Path(f'/proc/{process.pid}/status').read_text().splitlines()
        peak = max([peak] + [1024 * int(line.split()[1]) for line in lines if line.startswith('VmHWM')])
        time.sleep(0.005)
    if process.returncode not in (0, 1):
        raise RuntimeError(f'{part}: exit status {process.returncode}')
    return time.perf_counter() - start, peak


def growth(bench):
    """The whole check, reading included."""
    table('The whole check of ellipsoids', 'time', 'µs a face', 'memory', 'bytes a face')
    found = []
    for size in GROWTH_SIZES:
        path = bench.folder / 'growth.stl'
        bench.ours('stl', size, path)
        wall, memory = check(bench, path)
        path.unlink()
        faces = 20 * size ** 2
        found.append((faces, wall))
        row(f'{faces:,} faces', seconds(wall), f'{wall / faces * 1e6:.3g}', f'{memory / 2 ** 20:.4g} MB',
            f'{memory / faces:.4g}')
    slope = np.polyfit([math.log(f) for f, _ in found], [math.log(w) for _, w in found], 1)[0]
    print(f'\nslope in log-log: {slope:.3f} (aim {SLOPE_BAR})')


def parts(bench):
    """The whole check of raw CAD parts."""
    if bench.parts is None:
        return
    files = sorted(p for p in pathlib.Path(bench.parts).iterdir() if p.suffix.lower() == '.stl')
    table(f'The whole check of the {len(files)} parts of a folder', 'time')
    found = [check(bench, p)[0] for p in files]
    row('median', seconds(statistics.median(found)))
    row('slowest', f'{seconds(max(found))} ({files[found.index(max(found))].stem})')
    row('all', seconds(sum(found)))


def start(bench):
    """What a caller pays at least."""
    table('Start and size', '')
    median, slowest = bench.ours('start', 200)
    row('`ar_mesh_new` + `ar_compute` on 12 triangles, median of 200', f'{median:.2f} ms (slowest {slowest:.2f} ms)')
    library = bench.folder / 'stripped.so'
    subprocess.run(['strip', '-o', str(library), str(bench.programs / 'libarmesh.so')], check=True)
    row('shared library, stripped', f'{library.stat().st_size / 1e6:.2f} MB')


SECTIONS = {f.__name__: f for f in (d1, certified, d2, meshlab, parts, start, growth)}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument('programs')
    parser.add_argument('--parts')
    parser.add_argument('sections', nargs='*', help=' '.join(SECTIONS))
    given = parser.parse_intermixed_args()
    if unknown := [s for s in given.sections if s not in SECTIONS]:
        parser.error(f'unknown sections {unknown}')
    model = next((line.split(':', 1)[1].strip() for line in open('/proc/cpuinfo', encoding='utf-8')
                  if line.startswith('model name')), platform.machine())
    peers = ', '.join(f'{p} {importlib.metadata.version(p)}' for p in ('potpourri3d', 'meshlib', 'pymeshlab'))
    print(f'{time.strftime("%Y-%m-%d")}, {model}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f} before the '
          f'start; {peers}; CGAL, Embree of {platform.freedesktop_os_release()["PRETTY_NAME"]}')
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(given.programs, folder, given.parts)
        for name in given.sections or SECTIONS:
            SECTIONS[name](bench)


if __name__ == '__main__':
    multiprocessing.set_start_method('spawn')  # no solver state shared with the parent
    sys.exit(main())

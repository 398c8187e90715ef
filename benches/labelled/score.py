#!/usr/bin/env python3
"""Scores labelled parts: score.py FOLDER ARMESH-CHECK [NAME ...]; see README.md. Needs numpy only."""
import json
import pathlib
import struct
import subprocess
import sys
import tempfile

import numpy as np

LIMIT, MARGIN, OVERLAP = 8.0, 0.15, 0.5  # ratio of an error; left out of the judgement about it; area IoU of a find


def areas(path):
    data = path.read_bytes()
    (n,) = struct.unpack_from('<I', data, 80)
    kind = np.dtype([('n', '<f4', 3), ('v', '<f4', (3, 3)), ('a', '<u2')])
    v = np.frombuffer(data, kind, n, 84)['v'].astype(float)
    return np.linalg.norm(np.cross(v[:, 1] - v[:, 0], v[:, 2] - v[:, 0]), axis=1) / 2


def report(command, path):
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / 'report.json'
        run = subprocess.run([command, str(path), '--json', str(out)], capture_output=True, text=True)
        if not out.exists():
            print(f'{path.stem}: no report: {run.stderr.strip()[-200:]}')
            return np.full(len(areas(path)), -1), {}
        read = json.loads(out.read_text())
    return np.array(read['face_feature']), {f['id']: f['ratio'] or 0.0 for f in read['features']}


def match(area, mine, found):
    """Best found feature for a labelled one: (IoU, id)."""
    best = (0.0, -1)
    for k in np.unique(found[mine]):
        if k >= 0:
            common = area[mine & (found == k)].sum()
            best = max(best, (common / (area[mine].sum() + area[found == k].sum() - common), int(k)))
    return best


def judge(path, command):
    """Counts of one part, and a line for every miss or ratio that is off by 15 %."""
    truth = json.loads(path.with_suffix('.json').read_text())
    label = np.array(truth['face_feature'])
    area = np.where(label < 0, 0.0, areas(path))
    found, ratio = report(command, path)
    sums = dict(found=0, features=0, tp=0, fn=0, fp=0)
    errors, notes, used = [], [], set()
    expected = [f['expected_ratio'] for f in truth['features']]
    clear = [abs(e / LIMIT - 1) >= MARGIN for e in expected]
    for k, feature in enumerate(truth['features']):
        sums['features'] += 1
        iou, hit = match(area, label == k, found)
        flagged = False
        if iou >= OVERLAP:
            sums['found'] += 1
            used.add(hit)
            errors.append(ratio[hit] / expected[k] - 1)
            flagged = ratio[hit] >= LIMIT
        if clear[k]:
            sums['tp'] += expected[k] > LIMIT and flagged
            sums['fn'] += expected[k] > LIMIT and not flagged
            sums['fp'] += expected[k] < LIMIT and flagged
        if iou < OVERLAP:
            notes.append(f"  {k} {feature['kind']}: missed, IoU {iou:.2f} with {hit}, expected {expected[k]:.1f}")
        elif abs(errors[-1]) > 0.15:
            notes.append(f"  {k} {feature['kind']}: ratio {ratio[hit]:.1f}, expected {expected[k]:.1f}")
    for k in np.unique(found[found >= 0]):
        if int(k) not in used and ratio.get(int(k), 0) >= LIMIT:
            on = sum(area[(found == k) & (label == i)].sum() for i in range(len(expected)) if not clear[i] or expected[i] > LIMIT)
            if on < 0.5 * area[found == k].sum() or area[found == k].sum() == 0:
                sums['fp'] += 1
                notes.append(f'  false: found {k}, ratio {ratio[int(k)]:.1f}')
    return truth.get('family', path.stem.rstrip('0123456789')), sums, errors, notes


def line(name, sums, errors):
    f1 = 2 * sums['tp'] / max(2 * sums['tp'] + sums['fp'] + sums['fn'], 1)
    e = np.abs(errors) if errors else np.array([np.nan])
    return (
        f"{name:18s} found {sums['found']:4d}/{sums['features']:<4d} tp {sums['tp']:3d} fn {sums['fn']:3d} "
        f"fp {sums['fp']:3d} F1 {f1:.3f}  ratio error median {np.median(e):.3f} p90 {np.percentile(e, 90):.3f}"
    )


def main():
    folder, command, only = pathlib.Path(sys.argv[1]), sys.argv[2], sys.argv[3:]
    families, total = {}, (dict(found=0, features=0, tp=0, fn=0, fp=0), [])
    for path in sorted(folder.glob('*.stl')):
        if only and path.stem not in only:
            continue
        family, sums, errors, notes = judge(path, command)
        print(line(path.stem, sums, errors), *notes, sep='\n', flush=True)
        for to in (families.setdefault(family, (dict.fromkeys(sums, 0), [])), total):
            for key, value in sums.items():
                to[0][key] += int(value)
            to[1].extend(errors)
    print('\nby family')
    for family, (sums, errors) in sorted(families.items()):
        print(line(family, sums, errors))
    print(line('TOTAL', *total))


main()

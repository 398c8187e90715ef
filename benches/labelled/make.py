#!/usr/bin/env python3
"""Makes labelled parts: make.py FOLDER [SEED] [FAMILY ...]; see README.md."""
import pathlib
import sys
import time

import machined
import organic
import plates
import wheels
from draw import FAMILIES, Draw
from truth import write


def main():
    folder, seed, only = pathlib.Path(sys.argv[1]), int((sys.argv[2:] or ['1'])[0]), sys.argv[3:]
    folder.mkdir(parents=True, exist_ok=True)
    for family, make, times in FAMILIES:
        for number in range(times):
            if only and family not in only:
                continue
            start, u = time.time(), Draw(seed, family, number)
            part = make(u, number)
            verts, tris, labels = part.mesh()
            features = write(folder, f'{family}{number}', family, part.features, verts, tris, labels)
            rest = (labels < 0).mean()
            print(f'{family}{number}: {len(tris)} triangles, {len(features)} of {len(part.features)} features, '
                  f'{rest:.0%} not scored, {time.time() - start:.1f} s', flush=True)


main()

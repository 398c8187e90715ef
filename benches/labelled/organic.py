"""Families without any crease: implicit functions joined smoothly."""
import itertools
import math

import numpy as np

from draw import family
from solids import Implicit, block, capsule


@family(2)
def limbs(u, number):
    """What topology optimisation leaves: limbs between mounts and a middle."""
    p = Implicit(u(1.5, 3), 0.6, 0.02 + 0.03 * number)
    n, reach, rise = 3 + number, u(22, 30), u(10, 18)
    top = np.array([u(-3, 3), u(-3, 3), rise + 6])
    p.add(p.feature('mount', 6), block(top, (6, 6, 3), 1))
    for i in range(n):
        a = 2 * math.pi * i / n + u(-0.3, 0.3)
        at = np.array([reach * math.cos(a), reach * math.sin(a), 0])
        p.add(p.feature('mount', 5), block(at, (5, 5, 2.5), 1))
        d = u(2.2, 3.6)
        bow = 0.5 * (at + top) + np.array([0, 0, u(0, 4)])
        line = [(1 - s) ** 2 * at + 2 * s * (1 - s) * bow + s * s * top for s in np.linspace(0, 1, 7)]
        p.add(p.feature('limb', d), capsule(line, d / 2))
    p.bounds = (-reach - 8, -reach - 8, -4), (reach + 8, reach + 8, rise + 11)
    return p


@family(2)
def lattice(u, number):
    """Body-centred struts with blended nodes, between two plates or free."""
    d, cell = u(1.3, 2), u(9, 11)
    p = Implicit(d * 0.6, 0.32, 0.02)
    nx, ny = 2, 1 + number
    corners = list(itertools.product(range(nx + 1), range(ny + 1), range(2)))
    if number:
        t = u(2, 3)
        size = np.array([nx * cell, ny * cell])
        for z in (-t / 2, cell + t / 2):
            p.add(p.feature('plate', t), block((*(size / 2), z), (*(size / 2 + 2), t / 2), 0.5))
    for i, j in itertools.product(range(nx), range(ny)):
        middle = (np.array([i, j, 0]) + 0.5) * cell
        for c in itertools.product((0, 1), repeat=3):
            corner = (np.array([i, j, 0]) + c) * cell
            p.add(p.feature('strut', d), capsule([corner, middle], d / 2))
    if not number:  # free: bars along the edges
        for a, b in itertools.combinations(corners, 2):
            if sum(abs(x - y) for x, y in zip(a, b)) == 1:
                p.add(p.feature('bar', d), capsule([np.array(a) * cell, np.array(b) * cell], d / 2))
    p.bounds = (-4, -4, -5), (nx * cell + 4, ny * cell + 4, cell + 5)
    return p


@family(2)
def tree(u, number):
    """A support that branches, on a foot."""
    p = Implicit(u(1, 2), 0.55, 0.03)
    p.add(p.feature('foot', 5), block((0, 0, 2.5), (13, 13, 2.5), 0.8))
    trunk, d = np.array([0, 0, u(18, 26)]), u(4, 5.5)
    p.add(p.feature('trunk', d), capsule([(0, 0, 2), trunk], d / 2))
    for i in range(3):
        a, w = 2 * math.pi * i / 3 + u(-0.3, 0.3), u(2, 3)
        tip = trunk + np.array([math.cos(a) * u(12, 16), math.sin(a) * u(12, 16), u(12, 20)])
        p.add(p.feature('branch', w), capsule([trunk, tip], (w / 2, w / 2 * (1 if number == 0 else 0.8))))
    p.bounds = (-20, -20, -1), (20, 20, 52)
    return p


@family(1)
def grip(u, number):
    """A bow handle grown out of a thick block."""
    p, d, half, rise = Implicit(u(1.5, 3), 0.6, 0.03), u(3.5, 5), u(12, 16), u(12, 18)
    p.add(p.feature('block', 10), block((0, 0, 5), (half + 8, 10, 5), 1.5))
    bow = [(-half * math.cos(a), 0, 9 + rise * math.sin(a)) for a in np.linspace(0, math.pi, 13)]
    p.add(p.feature('handle', d), capsule(bow, d / 2))
    p.bounds = (-half - 9, -11, -1), (half + 9, 11, 9 + rise + d)
    return p

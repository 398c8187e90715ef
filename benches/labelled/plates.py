"""Families of fins, walls and pins on a body, sharp."""
import math

import numpy as np

from draw import family
from solids import Boolean, arc, bent, box, plate, rod, swept, turn


@family(2)
def heat_sink(u, number):
    p, t, gap, n = Boolean(), u(0.8, 1.6), u(2.5, 4), u.whole(5, 8)
    length, foot, height = u(25, 45), u(4, 7), u(10, 20)
    width = n * t + (n - 1) * gap
    margin = 0 if number == 0 else u(1, 3)
    p.add(p.feature('base', foot), box((0, 0, 0), (width + 2 * margin, length, foot)))
    for i in range(n):
        x = margin + i * (t + gap)
        p.add(p.feature('fin', t), box((x, margin, foot - 1), (x + t, length - margin, foot + height)))
    return p


@family(2)
def pin_sink(u, number):
    p, d, pitch, foot, height = Boolean(), u(1.2, 2.4), u(5, 7), u(4, 6), u(14, 24)
    columns, rows = u.whole(3, 5), u.whole(3, 4)
    top = d * (1 if number == 0 else u(0.55, 0.8))
    p.add(p.feature('base', foot), box((0, 0, 0), (pitch * columns, pitch * rows, foot)))
    for i in range(columns):
        for j in range(rows):
            x, y = (i + 0.5) * pitch, (j + 0.5) * pitch
            grown = d + (d - top) / height
            p.add(p.feature('pin', d), rod((x, y, foot - 1), (x, y, foot + height), grown / 2, top / 2, u.one_of(16, 24)))
    return p


@family(2)
def webbed_box(u, number):
    p, t, length, width, height = Boolean(), u(1, 1.8), u(40, 60), u(25, 40), u(12, 20)
    webs, w = u.whole(1, 3), u(0.7, 1.2)
    p.add(p.feature('floor', t), box((0, 0, 0), (length, width, t)))
    if number == 0:
        walls = [p.feature('wall', t) for _ in range(4)]
        boards = ((0, 0, length, t), (0, width - t, length, width), (0, t / 2, t, width - t / 2), (length - t, t / 2, length, width - t / 2))
        for label, (x0, y0, x1, y1) in zip(walls, boards):
            p.add(label, box((x0, y0, t / 2), (x1, y1, height)))
    else:
        r, corners = u(5, 8), []
        for k, (cx, cy) in enumerate(((length - r, width - r), (r, width - r), (r, r), (length - r, r))):
            corners += [(cx + x, cy + y) for x, y in arc(r, 90 * k, 90 * k + 90, 8)]
        scale = lambda q, s: [(s + x * (length - 2 * s) / length, s + y * (width - 2 * s) / width) for x, y in q]
        p.solids.clear()
        p.add(0, plate(corners, t))
        p.add(p.feature('ring', t), plate([corners, scale(corners, t)[::-1]], height, t / 2))
    for i in range(webs):
        x = length * (i + 1) / (webs + 1)
        p.add(p.feature('web', w), box((x, t / 2, t / 2), (x + w, width - t / 2, height * u(0.6, 0.8))))
    return p


@family(2)
def honeycomb(u, number):
    p, side, t, height, skin = Boolean(), u(7, 10), u(0.6, 1.1), u(8, 14), u(1.5, 3)
    cells = [(0, 0), (1, 0), (0, 1)] if number == 0 else [(0, 0), (1, 0), (0, 1), (-1, 1), (-1, 0), (0, -1), (1, -1)]
    walls = {}
    for q, r in cells:
        cx, cy = side * 1.5 * q, side * math.sqrt(3) * (r + q / 2)
        nodes = [(cx + x, cy + y) for x, y in arc(side, 0, 300, 5)]
        for a, b in zip(nodes, nodes[1:] + nodes[:1]):
            key = tuple(sorted([(round(a[0], 3), round(a[1], 3)), (round(b[0], 3), round(b[1], 3))]))
            walls[key] = (a, b)
    points = np.array([w for pair in walls.values() for w in pair])
    low, high = points.min(axis=0) - 2, points.max(axis=0) + 2
    p.add(p.feature('skin', skin), box((*low, 0), (*high, skin)))
    for a, b in walls.values():
        length, angle = math.dist(a, b), math.degrees(math.atan2(b[1] - a[1], b[0] - a[0]))
        wall = turn(box((0, -t / 2, skin - 0.5), (length, t / 2, skin + height)), angle).translate([*a, 0])
        p.add(p.feature('web', t), wall)
    return p


@family(1)
def knife_edges(u, number):
    p, length, foot, height = Boolean(), u(25, 40), u(5, 8), u(10, 16)
    n = u.whole(2, 4)
    p.add(p.feature('base', foot), box((0, 0, 0), (n * 9 + 3, length, foot)))
    for i in range(n):
        t, tip, x = u(1.6, 3), u(0.2, 0.5), 3 + 9 * i
        grown = (t - tip) / height / 2
        outline = [(x - grown, -1), (x + t + grown, -1), (x + (t + tip) / 2, height), (x + (t - tip) / 2, height)]
        wedge = turn(plate(outline, length - 4, 0), 90, 'x').translate([0, length - 2, foot])
        p.add(p.feature('knife', t), wedge)
    return p


@family(2)
def finned_cylinder(u, number):
    p, r, length, t, reach = Boolean(), u(6, 10), u(30, 45), u(0.8, 1.4), u(6, 11)
    p.add(p.feature('shaft', 2 * r), rod((0, 0, 0), (0, 0, length), r, None, 48))
    if number == 0:
        n = u.whole(4, 7)
        for i in range(n):
            fin = box((r - 1, -t / 2, 3), (r + reach, t / 2, length - 3))
            p.add(p.feature('fin', t), turn(fin, 360 * i / n))
    else:
        p.solids.clear()
        p.features.clear()
        # discs part the shaft: what lies between two of them is a piece of its own
        n, ends = 2, [length * 0.3, length * 0.7]
        for z in ends:
            p.add(p.feature('disc', t), rod((0, 0, z), (0, 0, z + t), r + reach, None, 64))
        for a, b in zip([0] + [e + t for e in ends], ends + [length]):
            p.add(p.feature('shaft', min(2 * r, b - a)), rod((0, 0, a), (0, 0, b), r, None, 48))
    return p


@family(2)
def arc_walls(u, number):
    p, foot, height = Boolean(), u(5, 8), u(10, 18)
    p.add(p.feature('base', foot), rod((0, 0, 0), (0, 0, foot), 26, None, 64))
    for radius, begin in ((9, u(0, 90)), (15, u(0, 90)), (21, u(0, 90))):
        t, span = u(0.8, 1.8), u(70, 230)
        wall = bent(radius, t, begin, begin + span, height + 1, foot - 1, 16 + 8 * number)
        p.add(p.feature('arc', t), wall)
    return p


@family(1)
def letters(u, number):
    p, t, foot, height = Boolean(), u(1.4, 2), u(3, 5), u(7, 11)
    size, x = 14, 3
    strokes = {
        'L': [((0, 0), (0, 1)), ((0, 0), (0.6, 0))],
        'T': [((0, 1), (0.8, 1)), ((0.4, 0), (0.4, 1))],
        'H': [((0, 0), (0, 1)), ((0.7, 0), (0.7, 1)), ((0, 0.5), (0.7, 0.5))],
        'E': [((0, 0), (0, 1)), ((0, 0), (0.6, 0)), ((0, 0.5), (0.5, 0.5)), ((0, 1), (0.6, 1))],
        'I': [((0, 0), (0, 1))],
    }
    word = ''.join(u.random.permutation(list(strokes)))[:4]
    base = p.feature('base', foot)
    for c in word:
        label = p.feature('letter', t)
        for (ax, ay), (bx, by) in strokes[c]:
            low = (x + ax * size, 4 + ay * size, foot - 0.5)
            p.add(label, box(low, (x + bx * size + t, 4 + by * size + t, foot + height)))
        x += max(b[0] for _, b in strokes[c]) * size + t + 4
    p.add(base, box((0, 0, 0), (x, size + t + 8, foot)))
    return p


@family(2)
def column(u, number):
    """Wings about an axis, standing on a base."""
    p, foot, height, n, t, reach = Boolean(), u(5, 8), u(25, 45), u.whole(3, 5), u(1, 2), u(7, 12)
    p.add(p.feature('base', foot), box((-20, -20, 0), (20, 20, foot)))
    for i in range(n):
        if number == 0:
            wing = box((0, -t / 2, foot - 1), (reach, t / 2, foot + height))
        else:
            wing = plate([(0, -t), (reach, -t / 4), (reach, t / 4), (0, t)], height + 1, foot - 1)
        p.add(p.feature('wing', t), turn(wing, 360 * i / n + 10))
    return p


@family(2)
def rails(u, number):
    p, length, foot = Boolean(), u(35, 60), u(5, 8)
    p.add(p.feature('base', foot), box((0, 0, 0), (34, length, foot)))
    for x in (10, 24):
        if number == 0:
            w, low, high, h = u(4, 6), u(1.2, 1.8), u(2, 3), u(3, 5)
            outline = [(x - w / 2 + low / 2, -1), (x + w / 2 - low / 2, -1), (x + w / 2 + high / 2, h), (x - w / 2 - high / 2, h)]
            p.add(p.feature('dovetail', h), turn(plate(outline, length), 90, 'x').translate([0, length, foot]))
        else:
            stem, head, h, w = u(1, 2), u(1, 2), u(6, 10), u(7, 10)
            p.add(p.feature('stem', stem), box((x - stem / 2, 0, foot - 1), (x + stem / 2, length, foot + h)))
            p.add(p.feature('head', head), box((x - w / 2, 0, foot + h), (x + w / 2, length, foot + h + head)))
    return p


@family(1)
def snap_fits(u, number):
    p, foot = Boolean(), u(4, 6)
    p.add(p.feature('base', foot), box((0, 0, 0), (40, 24, foot)))
    for x in (6, 17, 28):
        t, w, h, nose = u(1, 1.8), u(5, 8), u(12, 20), u(1, 1.8)
        z = foot + h
        outline = [(0, foot - 1), (t, foot - 1), (t, z - 2.2 * nose), (t + nose, z - 1.5 * nose), (t, z), (0, z)]
        clip = turn(turn(plate(outline, w), 90, 'x'), 90).translate([x, u(5, 12), 0])
        p.add(p.feature('snap', t), clip)
    return p


@family(2)
def coil(u, number):
    p, wire, radius, pitch, turns, foot = Boolean(), u(1.4, 2.2), u(6, 9), u(4.5, 6), u(2, 3.5), u(3, 5)
    p.add(p.feature('base', foot), rod((0, 0, 0), (0, 0, foot), radius + 5, None, 48))
    angle = np.linspace(0, 2 * math.pi * turns, int(turns * 32))
    path = np.stack([radius * np.cos(angle), radius * np.sin(angle), foot + wire + pitch * angle / 2 / math.pi], axis=1)
    post = [(radius, 0, foot - 1), (radius, 0, foot + 0.3 * wire)]
    p.add(p.feature('coil', wire), swept(np.concatenate([post, path[1:]]), wire / 2, (12, 20)[number]))
    return p

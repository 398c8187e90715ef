"""Families of wheels, tubes, levers and what is cut from plate, sharp."""
import math

import numpy as np
from manifold3d import Manifold

from draw import family
from solids import Boolean, bent, box, plate, rod, swept, turn


@family(2)
def pipes(u, number):
    """A main tube with branches and flanges."""
    p, r, t, length = Boolean(), u(7, 10), u(1, 2), u(45, 65)
    main = p.feature('tube', t)
    ends = [(np.array([0, 0, 0]), np.array([length, 0, 0]), r, main)]
    for i in range(u.whole(1, 3)):
        x, lean, reach = length * (0.25 + 0.25 * i), u(-25, 25) * number, r + u(10, 16)
        b, w = u(3.5, 5.5), u(0.8, 1.3)
        side = (-1) ** i
        tip = np.array([x + reach * math.tan(math.radians(lean)), 0, side * reach])
        label = p.feature('branch', w)
        ends.append((np.array([x, 0, 0]), tip, b, label))
        p.add(label, rod((x, 0, 0), tip, b, None, 32)).cut(label, rod((x, 0, 0), tip + (tip - [x, 0, 0]) * 0.2, b - w, None, 32))
        if u.whole(0, 1):
            along = (tip - [x, 0, 0]) / np.linalg.norm(tip - [x, 0, 0])
            f = u(1.2, 2)
            p.add(p.feature('flange', f), rod(tip - along * f, tip, b + u(3, 5), None, 48))
    for x in (0, length):
        f = u(1.5, 2.5)
        p.add(p.feature('flange', f), rod((x, 0, 0), (x + (f if x == 0 else -f), 0, 0), r + u(4, 7), None, 48))
    p.add(main, rod((0, 0, 0), (length, 0, 0), r, None, 48))
    p.cut(main, rod((-1, 0, 0), (length + 1, 0, 0), r - t, None, 48))
    return p


@family(2)
def impeller(u, number):
    p, r, h, n = Boolean(), u(6, 9), u(12, 18), u.whole(5, 9)
    p.add(p.feature('hub', min(h, 2 * r)), rod((0, 0, 0), (0, 0, h), r, None, 48))
    for i in range(n):
        t, reach = (u(0.9, 1.6), u(12, 18)) if i == 0 else (t, reach)
        if number == 0:  # bent blades, standing
            blade = bent(reach, t, -90, -20, h - 2, 1, 12).translate([r - 1, reach, 0])
        else:  # straight blades, pitched
            blade = turn(box((r - 2, -t / 2, -h * 0.4), (r + reach, t / 2, h * 0.4)), 35, 'x').translate([0, 0, h / 2])
            blade = blade ^ rod((0, 0, 1), (0, 0, h - 1), r + reach, None, 64)
        p.add(p.feature('blade', t), turn(blade, 360 * i / n))
    return p


@family(2)
def wheel(u, number):
    p, r, w, h, rim, n = Boolean(), u(22, 30), u(3, 5), u(6, 10), u(1.5, 3), u.whole(4, 7)
    bore = u(2, 3)
    hub = p.feature('hub', w)
    ring = p.feature('rim', min(rim, h))
    d = u(1.6, 2.6)
    p.add(ring, rod((0, 0, 0), (0, 0, h), r, None, 96) - rod((0, 0, -1), (0, 0, h + 1), r - rim, None, 96))
    p.add(hub, rod((0, 0, 0), (0, 0, h), bore + w, None, 48)).cut(hub, rod((0, 0, -1), (0, 0, h + 1), bore, None, 32))
    for i in range(n):
        a = 2 * math.pi * i / n
        to = np.array([math.cos(a), math.sin(a), 0])
        begin, end = to * (bore + w - 0.5) + [0, 0, h / 2], to * (r - rim / 2) + [0, 0, h / 2]
        if number == 0:
            p.add(p.feature('spoke', d), rod(begin, end, d / 2, None, 24))
        else:
            spoke = box((bore + w - 0.3, -d / 2, 1), (r - rim / 2, d / 2, h - 1))
            p.add(p.feature('spoke', d), turn(spoke, 360 * i / n))
    return p


@family(2)
def gear(u, number):
    """Teeth are flush with their body above and below: one outline."""
    p, r, n, h = Boolean(), u(12, 18), u.whole(8, 14), u(4, 8)
    length = r * 2 * math.pi / n * u(0.8, 1.1)
    body = p.feature('body', h)
    width = r * 2 * math.pi / n * (0.35 if number == 0 else 0.45)
    teeth = [p.feature('tooth', min(h, width)) for _ in range(n)]
    outline = []
    half, tip = width / 2 / r, width / 2 * (1 if number == 0 else 0.5)
    for i in range(n):
        a = 2 * math.pi * i / n
        for s in (-1, 1):
            foot = np.array([math.cos(a + s * half), math.sin(a + s * half)]) * r
            out = np.array([math.cos(a), math.sin(a)]) * (r + length) + s * tip * np.array([-math.sin(a), math.cos(a)])
            outline += [tuple(foot), tuple(out)] if s < 0 else [tuple(out), tuple(foot)]
        gap = np.linspace(a + half, a + 2 * math.pi / n - half, 4)[1:-1]
        outline += [(r * math.cos(b), r * math.sin(b)) for b in gap]

    def which(m):
        at = np.round(np.arctan2(m[:, 1], m[:, 0]) * n / 2 / math.pi).astype(int) % n
        inner = np.hypot(m[:, 0], m[:, 1]) < r * math.cos(half) + 1e-3
        inner |= np.hypot(m[:, 0], m[:, 1]) < r * 0.9999 - 1e-3
        return np.where(inner, body, np.array(teeth)[at])

    p.add(which, plate(outline, h)).cut(body, rod((0, 0, -1), (0, 0, h + 1), r * 0.35, None, 32))
    return p


def flush(p, rooms, outline, height):
    """One outline drawn up; each room (label, test of middles) takes what is not yet taken."""

    def which(m):
        labels = np.full(len(m), rooms[-1][0])
        for label, test in rooms[-2::-1]:
            labels = np.where(test(m[:, 0], m[:, 1]), label, labels)
        return labels

    return p.add(which, plate(outline, height))


@family(2)
def comb(u, number):
    p, n, h, depth, reach, t, gap = Boolean(), u.whole(5, 9), u(2, 4), u(6, 10), u(14, 24), u(1.2, 2), u(2.5, 4)
    rooms, outline = [], [(0, 0), (0, -depth), (n * t + (n - 1) * gap, -depth), (n * t + (n - 1) * gap, 0)]
    for i in reversed(range(n)):
        x = i * (t + gap)
        outline += [(x + t, 0), (x + t, reach), (x, reach), (x, 0)][(i == n - 1) : (3 if i == 0 else 4)]
        label = p.feature('tooth', min(t, h))
        rooms.append((label, lambda a, b, x=x: (b > 0) & (a > x - 0.1) & (a < x + t + 0.1)))
    rooms.append((p.feature('spine', min(h, depth)), None))
    return flush(p, rooms, outline[:4] + outline[4:], h)


@family(1)
def tuning_fork(u, number):
    p, t, gap, reach, yoke, stem, h = Boolean(), u(2, 3.5), u(5, 9), u(40, 60), u(5, 8), u(20, 30), u(3, 5)
    w = 2 * t + gap
    s = u(3, 4.5)
    outline = [(0, 0), ((w - s) / 2, 0), ((w - s) / 2, -stem), ((w + s) / 2, -stem), ((w + s) / 2, 0), (w, 0)]
    outline += [(w, yoke + reach), (w - t, yoke + reach), (w - t, yoke), (t, yoke), (t, yoke + reach), (0, yoke + reach)]
    rooms = [
        (p.feature('stem', min(s, h)), lambda a, b: b < 0),
        (p.feature('tine', min(t, h)), lambda a, b: (b > yoke) & (a < w / 2)),
        (p.feature('tine', min(t, h)), lambda a, b: (b > yoke) & (a > w / 2)),
        (p.feature('yoke', min(yoke, h)), None),
    ]
    return flush(p, rooms, outline, h)


@family(2)
def tensile(u, number):
    p, h, grip, w, gauge, narrow, r = Boolean(), u(2, 4), u(18, 25), u(14, 20), u(25, 45), u(3.5, 6), u(4, 7)
    step = (w - narrow) / 2
    bend = math.degrees(math.acos(max(0.0, 1 - step / r))) if step < r else 90
    curve = [(r * math.sin(math.radians(a)), r * (1 - math.cos(math.radians(a)))) for a in np.linspace(0, bend, 9)]
    x0 = gauge / 2
    quarter = [(x0 + x, narrow / 2 + y) for x, y in curve]
    x1 = quarter[-1][0]
    quarter += [(x1, w / 2), (x1 + grip, w / 2)]
    outline = quarter + [(x, -y) for x, y in quarter[::-1]]
    outline += [(-x, -y) for x, y in quarter] + [(-x, y) for x, y in quarter[::-1]]
    rooms = [
        (p.feature('gauge', min(h, narrow)), lambda a, b: np.abs(a) < x0 + 0.01),
        (-1, lambda a, b: np.abs(a) < x1 - 0.01),
        (p.feature('grip', h), lambda a, b: a > 0),
        (p.feature('grip', h), None),
    ]
    return flush(p, rooms, outline[::-1], h)


@family(1)
def hinge(u, number):
    p, t, length, n, r, w = Boolean(), u(2, 3), u(40, 60), u.whole(3, 4), u(3.2, 4.5), u(1, 1.5)
    leaf = p.feature('leaf', t)
    p.add(leaf, box((0, 0, 0), (length, u(20, 30), t)))
    pitch = length / (2 * n - 1)
    for i in range(n):
        label, x = p.feature('knuckle', w), 2 * i * pitch
        y, z = -r + 0.3, r
        p.add(label, rod((x, y, z), (x + pitch, y, z), r, None, 48))
        p.cut(label, rod((x - 0.1, y, z), (x + pitch + 0.1, y, z), r - w, None, 48))
    return p


@family(2)
def tubes(u, number):
    """Hollow tubes that meet in a ball."""
    p, n, r, t = Boolean(), 2 + number, u(4, 5), u(0.8, 1.4)
    a, step = u(0, 60), 360 / n if n > 2 else u(80, 130)
    p.add(-1, Manifold.sphere(r, 36)).cut(-1, Manifold.sphere(r - t, 36))
    for i in range(n):
        to = np.array([math.cos(math.radians(a + i * step)), math.sin(math.radians(a + i * step)), 0.0])
        reach, label = u(25, 40), p.feature('tube', t)
        p.add(label, rod((0, 0, 0), to * reach, r, None, 36))
        p.cut(label, rod((0, 0, 0), to * (reach + 1), r - t, None, 36))
    return p


@family(2)
def cup(u, number):
    p, r, h, t = Boolean(), u(14, 20), u(25, 40), u(1.4, 2.5)
    body, handle = p.feature('cup', t), u(2.5, 4)
    p.add(body, rod((0, 0, 0), (0, 0, h), r, None, 64)).cut(body, rod((0, 0, t), (0, 0, h + 1), r - t, None, 64))
    reach, low, high = u(8, 13), h * 0.2, h * 0.8
    if number == 0:
        label, y = p.feature('handle', handle), handle / 2
        p.add(label, box((r - 0.7 * t, -y, low), (r + reach, y, low + handle)))
        p.add(label, box((r - 0.7 * t, -y, high - handle), (r + reach, y, high)))
        p.add(label, box((r + reach - handle, -y, low), (r + reach, y, high)))
    else:
        middle, half = (low + high) / 2, (high - low) / 2
        path = [(r - 0.5 * t, 0, middle - half)] + [
            (r + reach * math.cos(a), 0, middle + half * math.sin(a)) for a in np.linspace(-1.45, 1.45, 24)
        ] + [(r - 0.5 * t, 0, middle + half)]
        p.add(p.feature('handle', handle), swept(path, handle / 2, 20))
    return p


@family(1)
def disc_on_shaft(u, number):
    p, r, t, big, a, b = Boolean(), u(2, 4), u(1, 1.8), u(14, 22), u(15, 25), u(15, 25)
    p.add(p.feature('disc', t), rod((0, 0, 0), (0, 0, t), big, None, 72))
    p.add(p.feature('shaft', 2 * r), rod((0, 0, t - 0.5), (0, 0, t + a), r, None, 32))
    p.add(p.feature('shaft', 2 * r), rod((0, 0, 0.5), (0, 0, -b), r, None, 32))
    return p


@family(2)
def twisted_blade(u, number):
    p, chord, t, reach, bend = Boolean(), u(12, 18), u(1.4, 2.2), u(30, 45), u(15, 45)
    foot = u(6, 9)
    for i in range(1 + number):
        x = i * 16
        section = [(chord / 2 * math.cos(a) , t / 2 * math.sin(a)) for a in np.linspace(0, 2 * math.pi, 28, endpoint=False)]
        blade = plate(section, reach, 0, n_divisions=24, twist_degrees=bend)
        p.add(p.feature('blade', t), blade.translate([0, x, foot - 0.5]))
    base = p.feature('root', foot)
    p.add(base, box((-chord / 2 - 3, -8, 0), (chord / 2 + 3, 8 + 16 * number, foot)))
    return p


@family(1)
def frame(u, number):
    """Bars about and across two windows, one outline."""
    p, length, width, b, h, c = Boolean(), u(50, 70), u(35, 50), u(4, 6), u(2.5, 4), u(1.6, 2.4)
    outer = [(0, 0), (length, 0), (length, width), (0, width)]
    middle = length * u(0.4, 0.6)
    windows = [[(x0, b), (x0, width - b), (x1, width - b), (x1, b)] for x0, x1 in ((b, middle - c / 2), (middle + c / 2, length - b))]
    rooms = [
        (p.feature('crossbar', min(c, h)), lambda x, y: (np.abs(x - middle) < c / 2 + 0.01) & (y > b - 0.01) & (y < width - b + 0.01)),
        (p.feature('frame', min(b, h)), None),
    ]
    return flush(p, rooms, [outer, *windows], h)

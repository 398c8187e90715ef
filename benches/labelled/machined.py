"""Families of CAD parts with rounded feet and holes."""
import math

from cadquery import Workplane

from cad import Cad, brick, drawn, pole
from draw import family


def cad(u, fillet=None):
    """Another deviation of the tessellation for each part."""
    return Cad(u.one_of(0.02, 0.05, 0.1), u.one_of(0.2, 0.35, 0.5), u(0.4, 0.9) if fillet is None else fillet)


@family(2)
def gusset_bracket(u, number):
    p, t, width, length, height = cad(u, None if number else 0.0), u(3, 5), u(30, 45), u(30, 45), u(30, 45)
    p.add(p.feature('foot', t), brick((0, 0, 0), (length, width, t)))
    p.add(p.feature('upright', t), brick((0, 0, t), (t, width, height)))
    n, w = u.whole(1, 3), u(1.2, 2.2)
    for i in range(n):
        y, a, b = width * (i + 0.5) / n - w / 2, (length - t) * 0.75, (height - t) * 0.75
        gusset = drawn([(t, t), (t + a, t), (t, t + b)], w).rotate((0, 0, 0), (1, 0, 0), 90).translate((0, y + w, 0))
        p.add(p.feature('gusset', w), gusset)
    foot_hole = pole((length * 0.85, width * 0.25, -1), (length * 0.85, width * 0.25, t + 1), 1.6)
    return p.cut(0, foot_hole)


@family(2)
def clevis(u, number):
    p, w, block, t, r, reach = cad(u, None if number else 0.0), u(22, 30), u(10, 15), u(2, 4), u(6, 8), u(18, 28)
    p.add(p.feature('block', block), brick((-w / 2, -r - 2, 0), (w / 2, r + 2, block)))
    n = 2 + number
    for i in range(n):
        x = -w / 2 + 2 + (w - 4 - t) * i / (n - 1)
        lug = brick((x, -r, block), (x + t, r, block + reach)).union(pole((x, 0, block + reach), (x + t, 0, block + reach), r))
        label = p.feature('lug', t)
        p.add(label, lug)
        p.cut(label, pole((x - 0.1, 0, block + reach), (x + t + 0.1, 0, block + reach), r * 0.5))
    return p


@family(2)
def bellcrank(u, number):
    """Arms thinner than their bosses (a rounded foot each), or as thick as they are (flush)."""
    p, h, t = cad(u, None if number else 0.0), u(8, 12), u(2.5, 4)
    hub, bore, end, w = u(7, 9), u(3, 4), u(4, 5), u(3.5, 5)
    p.add(p.feature('hub', hub - bore), pole((0, 0, 0), (0, 0, h), hub))
    angle = 0
    for _ in range(2 + number):
        reach = u(25, 40)
        to = (reach * math.cos(angle), reach * math.sin(angle))
        label, hole = p.feature('boss', end - 2), pole((*to, -1), (*to, h + 1), 2)
        p.add(label, pole((*to, 0), (*to, h), end)).cut(label, hole)
        arm = brick((0, -w / 2, h / 2 - t / 2), (reach, w / 2, h / 2 + t / 2))
        arm = arm.cut(pole((0, 0, -1), (0, 0, h + 1), hub - 0.3)).cut(pole((reach, 0, -1), (reach, 0, h + 1), end - 0.3))
        p.add(p.feature('arm', min(t, w)), arm.rotate((0, 0, 0), (0, 0, 1), math.degrees(angle)))
        angle += math.radians(u(80, 120))
    return p.cut(0, pole((0, 0, -1), (0, 0, h + 1), bore))


@family(2)
def lid(u, number):
    """A lid with a handle of round or square bar."""
    p, r, t, d = cad(u, None if number else 0.0), u(22, 30), u(4, 6), u(3, 4.5)
    p.add(p.feature('lid', t), pole((0, 0, 0), (0, 0, t), r))
    half, rise, bend = u(10, 14), u(12, 18), 5
    c, top = bend * (1 - math.sqrt(0.5)), t + rise
    path = Workplane('XZ').moveTo(-half, t - 1).lineTo(-half, top - bend)
    path = path.threePointArc((c - half, top - c), (bend - half, top)).lineTo(half - bend, top)
    path = path.threePointArc((half - c, top - c), (half, top - bend)).lineTo(half, t - 1)
    start = Workplane('XY', origin=(-half, 0, t - 1))
    profile = start.circle(d / 2) if number == 0 else start.rect(d, d)
    return p.add(p.feature('handle', d), profile.sweep(path))


@family(2)
def hook(u, number):
    p, d, foot, shank, r = cad(u, None if number else 0.0), u(3, 5), u(5, 8), u(15, 25), u(7, 11)
    p.add(p.feature('base', foot), brick((-12, -12, 0), (12, 12, foot)))
    span = math.radians(u(170, 230))
    path = Workplane('XZ').moveTo(0, foot - 1).lineTo(0, foot + shank)
    mid, end = [(r - r * math.cos(a), foot + shank + r * math.sin(a)) for a in (span / 2, span)]
    path = path.threePointArc(mid, end)
    return p.add(p.feature('hook', d), Workplane('XY', origin=(0, 0, foot - 1)).circle(d / 2).sweep(path))


@family(2)
def ribbed_plate(u, number):
    p, t, length, width, w, h = cad(u, None if number else 0.0), u(3, 4), u(45, 60), u(30, 40), u(1.2, 2.2), u(6, 10)
    p.add(p.feature('plate', t), brick((0, 0, 0), (length, width, t)))
    rows = [width * f for f in ((0.5,) if number else (0.33, 0.67))]
    for y in rows:
        p.add(p.feature('rib', w), brick((3, y - w / 2, t), (length - 3, y + w / 2, t + h)))
    edges = [3] + [y + s * w / 2 for y in rows for s in (-1, 1)] + [width - 3]
    for x in (length * 0.35, length * 0.7):
        for a, b in zip(edges[::2], edges[1::2]):
            p.add(p.feature('rib', w), brick((x - w / 2, a, t), (x + w / 2, b, t + h * 0.7)))
    return p


@family(2)
def standoffs(u, number):
    """Bosses with holes and ribs beside them, pins with rounded feet."""
    p, t = cad(u), u(3, 5)
    p.add(p.feature('plate', t), brick((0, 0, 0), (50, 40, t)))
    for x, y in ((9, 9), (41, 9), (41, 31)):
        r, wall, h = u(3, 4), u(0.9, 1.5), u(8, 14)
        label = p.feature('boss', wall)
        p.add(label, pole((x, y, t), (x, y, t + h), r)).cut(label, pole((x, y, t), (x, y, t + h + 1), r - wall))
    for x, y in ((9, 31), (25, 20)):
        d = u(1.8, 3)
        p.add(p.feature('pin', d), pole((x, y, t), (x, y, t + u(15, 25)), d / 2))
    return p


@family(1)
def elbow(u, number):
    """A bent pipe between two square flanges."""
    p, r, t, bend, f = cad(u, 0.0), u(5, 8), u(1, 1.6), u(18, 26), u(2.5, 4)
    c = bend * (1 - math.sqrt(0.5))

    def swept(radius):
        path = Workplane('XZ').moveTo(0, 0).lineTo(0, 8)
        path = path.threePointArc((c, 8 + bend - c), (bend, 8 + bend)).lineTo(bend + 8, 8 + bend)
        return Workplane('XY').circle(radius).sweep(path)

    label = p.feature('pipe', t)
    s = r + 6
    p.add(label, swept(r))
    p.add(p.feature('flange', f), brick((-s, -s, 0), (s, s, f)))
    p.add(p.feature('flange', f), brick((bend + 8 - f, -s, 8 + bend - s), (bend + 8, s, 8 + bend + s)))
    return p.cut(label, swept(r - t))

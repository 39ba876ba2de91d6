"""Pins and teeth, compiled: force of one pin by its compression, exact distances of pins from many tooth profiles.

Every law of force is convex in energy and C¹ under load.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from tolalloc.reducers.cycloid.solvers import LINEAR
from tolalloc.running.compiled import in_threads, jit, jit_in_place

_STIFFEST = 2.0  # ln(cλ/F) at which the logarithmic law goes on straight: a force that no part carries
# Fields of a design, `tolalloc.reducers.cycloid.clearance` fills them.
CIRCLE, PIN, ECCENTRICITY, TEETH, GROUND_CIRCLE, GROUND_PIN, ROTATION, ROOT, TIP, BEND, FIELDS = range(11)
_GRID = 384  # points of the scan over a tooth and a part of its neighbours
_NEAR = 0.3  # distance from the path over its radius, and slip along it [rad], up to which the nearest point is plain
_AT_ONCE = 16  # designs that a thread takes together
_BEYOND = 1.0  # how far the scan goes beyond the tips on either side [rad]


@jit_in_place
def _logarithmic(stiffness, log_length, compression):
    """Return force [N] and its derivative [N/m] of Hertzian line contact, theory page equation (30).

    The approach is F/c·ln(cλ/F) with c = 2·stiffness. With w = ln(cλ/F) it reads w − ln w = ln(λ/compression), which
    Newton's method solves. λ is given by its logarithm, because a pin that bends easily makes it huge.
    """
    scale = 2.0 * stiffness
    goal = log_length - np.log(compression)
    if goal <= _STIFFEST - np.log(_STIFFEST):
        force = scale * np.exp(log_length - _STIFFEST)
        beyond = compression - force / scale * _STIFFEST
        return force + scale / (_STIFFEST - 1.0) * beyond, scale / (_STIFFEST - 1.0)
    w = goal + np.log(goal + 1.0)
    for _ in range(8):
        change = (w - np.log(w) - goal) * w / (w - 1.0)
        w -= change
        if abs(change) <= 1e-15 * w:
            break
    return scale * compression / w, scale / (w - 1.0)


@jit_in_place
def pin_force(law, stiffness, log_length, half_tilt, compression):
    """Return force [N] and its derivative [N/m] of one pin contact, theory page equations (30) and (31).

    ``half_tilt`` is how much deeper the tilted tooth's end lies than its middle [m], (31), for linear laws only.

    F = K·δ of the linear laws; δ = F/c·ln(cλ/F) of the logarithmic one, c = 2·``stiffness``, going on straight where
    ln(cλ/F) falls to 2; 0 for δ ≤ 0 [m].

    References
    ----------
    Hertz's line contact with Li Lixing's constant, see `tolalloc.reducers.cycloid.loaded_contact.equivalent_length`;
    the tilt is an own derivation.

    Examples
    --------
    >>> force, slope = pin_force.py_func(LINEAR, 2e8, 0.0, 0.0, 1e-6)  # 1 µm at 200 N/µm [N, N/m]
    >>> round(force, 6), slope
    (200.0, 200000000.0)
    """
    if abs(compression) < half_tilt:  # one end of the tooth is lifted
        deep = compression + half_tilt
        slope = stiffness * deep / (2.0 * half_tilt)
        return 0.5 * slope * deep, slope
    if not compression > 0.0:
        return 0.0, 0.0
    if law == LINEAR:
        return stiffness * compression, stiffness
    return _logarithmic(stiffness, log_length, compression)


@jit_in_place
def _fill(law, stiffness, log_length, compression, force, slope):
    for k in range(compression.size):
        force[k], slope[k] = pin_force(law, stiffness[k], log_length[k], 0.0, compression[k])


def pin_forces(law: int, stiffness: Any, log_length: Any, compression: Any) -> tuple[Any, Any]:
    """Return forces [N] and their derivatives [N/m] of pins that stand straight, in the shape of their compressions."""
    force, slope = np.empty(compression.size), np.empty(compression.size)
    _fill(law, stiffness.ravel(), log_length.ravel(), compression.ravel(), force, slope)
    return force.reshape(compression.shape), slope.reshape(compression.shape)


@jit_in_place
def _shortening(design):
    return design[ECCENTRICITY] * (design[TEETH] + 1.0) / design[GROUND_CIRCLE]


@jit_in_place
def _to_pole(shortening, cosine):
    """Return the distance of the grinding pin's centre from the pole over the radius of its circle."""
    return np.sqrt(1.0 + shortening * shortening - 2.0 * shortening * cosine)


@jit_in_place
def _off_path(design, t, px, py):
    """Return P in the frame that turns with the pin at parameter t, less the path of its centre; cos t and sin t."""
    small, c, s = t / design[TEETH], np.cos(t), np.sin(t)
    cs, ss = np.cos(small), np.sin(small)
    u = px * cs - py * ss - (design[GROUND_CIRCLE] - design[ECCENTRICITY] * c)
    v = px * ss + py * cs - design[ECCENTRICITY] * s
    return u, v, c, s


@jit
def _point(design, t):
    """Return x and y of the profile at parameter t, before its flanks are turned."""
    shortening, small, c, s = _shortening(design), t / design[TEETH], np.cos(t), np.sin(t)
    ratio = design[GROUND_PIN] / _to_pole(shortening, c)
    # In the frame that turns with the pin, then in the disc's.
    u = design[GROUND_CIRCLE] - design[ECCENTRICITY] * c + ratio * (shortening * c - 1.0)
    v = design[ECCENTRICITY] * s - ratio * shortening * s
    return u * np.cos(small) + v * np.sin(small), v * np.cos(small) - u * np.sin(small)


@jit
def _scan(design, x, y):
    """Fill points of the profile on equally spaced parameters; return the first one and their distance."""
    first, step = -np.pi - _BEYOND, 2.0 * (np.pi + _BEYOND) / (_GRID - 1)
    for i in range(_GRID):
        x[i], y[i] = _point(design, first + i * step)
    return first, step


@jit
def _slope(design, t, px, py):
    """Return f = (P − w)·w′ and its derivative at parameter t, w the path of the grinding pin's centre.

    f vanishes where P lies on the normal of the path, which is the profile's normal too.
    """
    teeth, circle, eccentricity = design[TEETH], design[GROUND_CIRCLE], design[ECCENTRICITY]
    u, v, c, s = _off_path(design, t, px, py)
    turns = (teeth + 1.0) / teeth
    du, dv = eccentricity * turns * s, eccentricity * turns * c - circle / teeth
    ddu, ddv = eccentricity * turns * turns * c - circle / (teeth * teeth), -eccentricity * turns * turns * s
    return u * du + v * dv, u * ddu + v * ddv - du * du - dv * dv


@jit
def _foot(design, low, high, px, py):
    """Return the parameter between low and high where f falls through zero: Newton's method kept in its bracket."""
    t = 0.5 * (low + high)
    for _ in range(60):
        f, slope = _slope(design, t, px, py)
        if f > 0.0:
            low = t
        else:
            high = t
        new = t - f / slope if slope < 0.0 else 0.5 * (low + high)
        if not low <= new <= high:
            new = 0.5 * (low + high)
        change, t = abs(new - t), new
        if change <= 1e-15 * (1.0 + abs(t)):
            break
    return t


@jit
def _distance(design, t, px, py):
    """Return the distance of P from the profile along the normal at t, negative inside the disc."""
    shortening, (u, v, c, s) = _shortening(design), _off_path(design, t, px, py)
    root = _to_pole(shortening, c)
    # The normal into the disc in the same frame.
    nu, nv = (shortening * c - 1.0) / root, -shortening * s / root
    return design[GROUND_PIN] - (u * nu + v * nv)


@jit
def _nearest(design, x, y, first, step, px, py):
    """Return the smallest distance of P from the whole profile, or from the flank between its edges if it is turned."""
    best, before, here, turned = np.inf, -1.0, np.inf, design[ROTATION] > 0.0
    for i in range(_GRID):
        dx, dy = px - x[i], py - y[i]
        after = dx * dx + dy * dy
        if here <= before and here <= after:  # the scan's ends are never a place of nearest approach
            t = _foot(design, first + (i - 2) * step, first + i * step, px, py)
            if not turned or design[ROOT] <= t <= design[TIP]:
                best = min(best, _distance(design, t, px, py))
        before, here = here, after
    if turned:
        for edge in range(2):
            ex, ey = _point(design, design[ROOT + edge])
            best = min(best, np.sqrt((px - ex) * (px - ex) + (py - ey) * (py - ey)))
    return best


@jit
def _largest_bend(design, angle, convex):
    """Return the largest curvature of the grinding pin's path from an angle away from the root [1/m].

    The path bends most at the root and less and less up to the inflection; beyond, ``convex`` is its largest.
    """
    pins = design[TEETH] + 1.0
    shortening = design[ECCENTRICITY] * pins / design[GROUND_CIRCLE]
    c = np.cos(angle)
    s = 1.0 + shortening * shortening - 2.0 * shortening * c
    bend = shortening * (1.0 + pins) * c - 1.0 - pins * shortening * shortening
    return max(bend / (design[GROUND_CIRCLE] * s * np.sqrt(s)), convex)


@jit
def _near(design, convex, angle, px, py):
    """Return the distance of P from the profile next to an angle; nan where another place could be as near.

    Around P, which is off the path by much less than the path's radius, the path has one nearest point. Newton's method
    finds it; a step below a microradian leaves an error that the distance does not feel.
    """
    u, v, c, _ = _off_path(design, angle, px, py)
    off = np.sqrt(u * u + v * v)
    slip = off * design[TEETH] / (design[GROUND_CIRCLE] * _to_pole(_shortening(design), c))
    inner = max(abs(angle) - 2.0 * slip, 0.0)
    if slip > _NEAR or off * _largest_bend(design, inner, convex) > _NEAR:
        return np.nan
    t = angle
    for _ in range(12):
        f, slope = _slope(design, t, px, py)
        change = f / slope
        t -= change
        if abs(change) < 1e-6:
            return _distance(design, t, px, py)
    return np.nan


@jit
def _design_clearances(design, pin_angle, turned, clearance):
    """Fill the clearances [m] of pins at exact places on a turned disc, [pin].

    ``turned`` are the rotations of the disc, one for each pin. Flanks turned by a positive rotation modification leave
    what both positions of the profile have in common: nearest is a flank, its mirror image across the root or across
    the tooth, or an edge between them. A negative one leaves all that either position has.
    """
    x, y = np.empty(_GRID), np.empty(_GRID)
    first, step, scanned = 0.0, 0.0, False
    teeth, turns, rotation = design[TEETH], (design[TEETH] + 1.0) / design[TEETH], design[ROTATION]
    c, s = np.cos(rotation), np.sin(rotation)
    whole_c, whole_s = np.cos(rotation - 2.0 * np.pi / teeth), np.sin(rotation - 2.0 * np.pi / teeth)
    for k in range(pin_angle.size):
        a = pin_angle[k]
        px = design[CIRCLE] * np.cos(a / teeth + turned[k]) - design[ECCENTRICITY] * np.cos(a * turns + turned[k])
        py = design[ECCENTRICITY] * np.sin(a * turns + turned[k]) - design[CIRCLE] * np.sin(a / teeth + turned[k])
        own = np.nan
        if rotation == 0.0:
            own = _near(design, design[BEND], a, px, py)
            if own == own:
                clearance[k] = own - design[PIN]
                continue
        if not scanned:
            first, step = _scan(design, x, y)
            scanned = True
        own = _nearest(design, x, y, first, step, px * c - py * s, px * s + py * c)
        if rotation != 0.0:
            own = min(own, _nearest(design, x, y, first, step, px * c + py * s, px * s - py * c))
        if rotation > 0.0:
            qx, qy = px * whole_c + py * whole_s, px * whole_s - py * whole_c
            own = min(own, _nearest(design, x, y, first, step, qx, qy))
        clearance[k] = own - design[PIN]


@jit
def _clearances(designs, pin_angle, turned, clearance):
    for d in range(designs.shape[0]):
        _design_clearances(designs[d], pin_angle, turned[d], clearance[d])


def pin_clearances(designs: Any, pin_angle: Any, turned: Any, clearance: Any) -> None:
    """Fill the clearances [m] of pins on the discs of many designs, [design, pin]; ``designs`` are [design, FIELDS]."""

    def fill(part: slice) -> None:
        _clearances(designs[part], pin_angle, turned[part], clearance[part])

    in_threads(fill, designs.shape[0], _AT_ONCE)

"""Clearances between pins and modified teeth by a brute-force search that knows nothing of the package's own.

It takes song2019's printed points, sampled densely and refined twice around the nearest two places. A disc stands in
the ring of pins by the construction of the drive: seen from a fixed pin at angle 0, the crank is at −φ, and the disc
has turned by φ/zc.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.optimize import brentq

from tests.verification.test_tooth_profile import modified_points, path_bend
from tolalloc.reducers.cycloid.tooth_profile import ToothProfile
from tolalloc.reducers.reducer.design import CycloidStage, Modification

Curve = Callable[[np.ndarray], np.ndarray]


def pin_on_disc(stage: CycloidStage, pin_angle: np.ndarray, turned: float | np.ndarray) -> np.ndarray:
    """Centres of pins in the frame of a disc that is turned about its own centre beyond its place."""
    from_crank = stage.pin_circle_radius - stage.eccentricity * np.exp(-1j * pin_angle)
    return from_crank * np.exp(-1j * (pin_angle / stage.disc_teeth + turned))


def nearest(curve: Curve, low: float, high: float, points: np.ndarray, count: int) -> np.ndarray:
    """Distance of points from a piece of a curve, its ends included, negative on the right of it."""
    places = np.linspace(low, high, count)
    far = np.abs(points[:, np.newaxis] - curve(places))
    walls = np.pad(far, ((0, 0), (1, 1)), constant_values=np.inf)
    least = np.where((far <= walls[:, :-2]) & (far <= walls[:, 2:]), far, np.inf)
    found, row = np.full(points.size, np.inf), np.arange(points.size)
    for _ in range(2):  # two places may be equally near but for what the sampling hides
        at = least.argmin(axis=1)
        least[row, at] = np.inf
        place, step = places[at], places[1] - places[0]
        for _ in range(2):
            around = np.clip(place[:, np.newaxis] + step * np.linspace(-1, 1, 301), low, high)
            distance = np.abs(points[:, np.newaxis] - curve(around))
            place, step = around[row, distance.argmin(axis=1)], step / 150
        # What is left of the step is 1e-6 rad: along the curve 1e-9 m, in the distance its square over a radius.
        here, ahead = curve(place), curve(place + 1e-6) - curve(place - 1e-6)
        side = np.sign(((points - here).conj() * 1j * ahead).real)
        distance = side * distance.min(axis=1)
        found = np.where(np.abs(distance) < np.abs(found), distance, found)
    return found


def searched(
    stage: CycloidStage, amounts: Modification, pin_angle: np.ndarray, turned: float | np.ndarray = 0.0
) -> np.ndarray:
    """Clearance of pins from teeth without rotation modification, negative where they overlap [m]."""
    still = replace(amounts, rotation=0.0)
    points = pin_on_disc(stage, pin_angle, turned)
    return nearest(lambda at: modified_points(stage, still, at), -3 * np.pi, 3 * np.pi, points, 1201) - stage.pin_radius


def searched_between(
    stage: CycloidStage, amounts: Modification, pin_angle: np.ndarray, turned: float = 0.0
) -> np.ndarray:
    """Clearance where each flank is turned towards the middle of its tooth: a disc is what both positions leave.

    Between the middles of a root and of a tooth that is the flank turned by δ, up to the edges where it meets its
    mirror image. Nearest may be the flank itself, its mirror image across the root or that across the tooth.
    """

    def flank(at: np.ndarray) -> np.ndarray:
        return modified_points(stage, amounts, at)

    half_tooth = np.pi / stage.disc_teeth
    root = brentq(lambda at: np.angle(flank(np.array([at])))[0], -1.0, 1.0, xtol=1e-15)
    tip = brentq(lambda at: np.angle(flank(np.array([at])))[0] + half_tooth, 1.0, 5.0, xtol=1e-15)
    points, whole = pin_on_disc(stage, pin_angle, turned), np.exp(-2j * half_tooth)
    images = points, points.conj(), points.conj() * whole
    # Pins outside of a convex edge have no side, and none of them is inside.
    return np.min([np.abs(nearest(flank, root, tip, image, 601)) for image in images], axis=0) - stage.pin_radius


def grindable(stage: CycloidStage, amounts: Modification) -> bool:
    circle, pin = stage.pin_circle_radius + amounts.shift, stage.pin_radius + amounts.equidistant
    if not 0 < stage.eccentricity * stage.pin_count < circle:
        return False
    return 0 < pin < 1 / path_bend(replace(stage, pin_circle_radius=circle), np.linspace(0, np.pi, 2001)).max()


def random_amounts(generator: np.random.Generator) -> Modification:
    """From 1 µm to 1 mm, with any signs; material is added up to 0.2 mm by the grinding pin."""
    sizes = 10 ** generator.uniform(-6, -3, 2)
    signs = generator.choice([-0.2, 1.0]), generator.choice([-1.0, 1.0])
    return Modification(equidistant=signs[0] * sizes[0], shift=signs[1] * sizes[1])


def places(stage: CycloidStage, amounts: Modification, generator: np.random.Generator) -> np.ndarray:
    """Root, tip, inflection and a few others on both flanks."""
    inflection = ToothProfile(stage=stage, modification=amounts).inflection_angle
    return np.concatenate([[0.0, np.pi, inflection], generator.uniform(-np.pi, np.pi, 4)])

"""The tooth profile against song2019's printed equations, finite differences and dense scans."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

from tests.random_cases import random_cycloid_stage, seeds
from tolalloc.exceptions import InputError
from tolalloc.reducers.cycloid.tooth_profile import ToothProfile, require_sound
from tolalloc.reducers.reducer.design import CycloidStage, Modification

SEEDS = seeds(40)
AROUND = np.linspace(-np.pi, np.pi, 4001)
FIRST = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0, 4 / 5, -1 / 5, 4 / 105, -1 / 280])
SECOND = np.array([-1 / 560, 8 / 315, -1 / 5, 8 / 5, -205 / 72, 8 / 5, -1 / 5, 8 / 315, -1 / 560])
"""Central differences of eighth order, of the first and of the second derivative."""
# A root's shape changes within 1 − K1 ≥ 0.15 rad, so the truncation is some (STEP/0.15)^8 = 3e-13. Rounding is
# 1e-17 m/STEP² in the second derivative against a speed of 1e-4 m or more: 1e-8 of the curvature, 1e-11 of the normal.
STEP = 4e-3


def standard_points(stage: CycloidStage, angle: np.ndarray) -> np.ndarray:
    """song2019, equations (1) and (2), as complex numbers."""
    ratio, k1 = stage.pin_count / stage.disc_teeth, stage.eccentricity * stage.pin_count / stage.pin_circle_radius
    s = 1 + k1**2 - 2 * k1 * np.cos(angle)
    long = stage.pin_circle_radius - stage.pin_radius * s**-0.5
    short = stage.eccentricity - k1 * stage.pin_radius * s**-0.5
    x = long * np.cos((1 - ratio) * angle) - short * np.cos(ratio * angle)
    y = long * np.sin((1 - ratio) * angle) + short * np.sin(ratio * angle)
    return x + 1j * y


def modified_points(stage: CycloidStage, amounts: Modification, angle: np.ndarray) -> np.ndarray:
    """song2019, equations (3) and (4), as complex numbers."""
    ratio, turned = stage.pin_count / stage.disc_teeth, amounts.rotation
    circle, pin = stage.pin_circle_radius + amounts.shift, stage.pin_radius + amounts.equidistant
    k1 = stage.eccentricity * stage.pin_count / circle
    s = 1 + k1**2 - 2 * k1 * np.cos(angle)
    long = circle - pin * s**-0.5
    short = stage.eccentricity / circle * (circle - stage.pin_count * pin * s**-0.5)
    x = long * np.cos((1 - ratio) * angle - turned) - short * np.cos(ratio * angle + turned)
    y = long * np.sin((1 - ratio) * angle - turned) + short * np.sin(ratio * angle + turned)
    return x + 1j * y


def path(stage: CycloidStage, angle: np.ndarray, derivative: int = 0) -> np.ndarray:
    """Centre of a pin seen from the disc, and its derivatives by φ."""
    slow, fast = -1j / stage.disc_teeth, -1j * stage.pin_count / stage.disc_teeth
    long = slow**derivative * stage.pin_circle_radius * np.exp(slow * angle)
    return long - fast**derivative * stage.eccentricity * np.exp(fast * angle)


def path_bend(stage: CycloidStage, angle: np.ndarray) -> np.ndarray:
    """Curvature of that path, convex positive; it runs clockwise around the disc [1/m]."""
    first, second = path(stage, angle, 1), path(stage, angle, 2)
    return -(first.conj() * second).imag / np.abs(first) ** 3


def random_modification(stage: CycloidStage, generator: np.random.Generator) -> Modification:
    """Any signs, up to 5 % of the pin radius: a pin that could grind the teeth before still can."""
    equidistant, shift = generator.uniform(-0.05, 0.05, 2) * stage.pin_radius
    return Modification(equidistant=equidistant, shift=shift, rotation=generator.uniform(-0.005, 0.005))


def any_stage(generator: np.random.Generator) -> CycloidStage:
    """From nearly a circle to nearly a cusped path; its pins may not fit."""
    pins, circle = int(generator.integers(6, 120)), generator.uniform(0.02, 0.2)
    return CycloidStage(
        pin_count=pins,
        disc_teeth=pins - 1,
        pin_circle_radius=circle,
        pin_radius=1e-3,
        eccentricity=generator.uniform(0.01, 0.99) * circle / pins,
        face_width=0.01,
    )


def derivatives(profile: ToothProfile, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First and second derivative of song2019's points by φ."""
    around = angle[:, np.newaxis] + STEP * np.arange(-4, 5)
    points = modified_points(profile.stage, profile.modification, around)
    return points @ FIRST / STEP, points @ SECOND / STEP**2


def complex_points(profile: ToothProfile, angle: np.ndarray) -> np.ndarray:
    return profile.points(angle) @ [1, 1j]


@pytest.mark.parametrize("seed", SEEDS)
def test_points_are_those_that_song2019_prints(seed):
    generator = np.random.default_rng(seed)
    stage = random_cycloid_stage(generator)
    amounts = random_modification(stage, generator)
    ulp = np.spacing(2 * stage.pin_circle_radius)  # some of them are the rounding of either side
    standard = complex_points(ToothProfile(stage=stage), AROUND)
    np.testing.assert_allclose(standard, standard_points(stage, AROUND), rtol=0, atol=10 * ulp)
    modified = complex_points(ToothProfile(stage=stage, modification=amounts), AROUND)
    np.testing.assert_allclose(modified, modified_points(stage, amounts, AROUND), rtol=0, atol=10 * ulp)


@pytest.mark.parametrize("seed", SEEDS)
def test_tip_and_root_are_the_outermost_and_innermost_points(seed):
    generator = np.random.default_rng(seed)
    stage = random_cycloid_stage(generator)
    profile = ToothProfile(stage=stage, modification=random_modification(stage, generator))
    radius = np.abs(modified_points(stage, profile.modification, AROUND))
    assert profile.tip_radius == pytest.approx(radius.max(), rel=1e-14)
    assert profile.root_radius == pytest.approx(radius.min(), rel=1e-14)
    assert abs(AROUND[radius.argmax()]) == np.pi
    assert AROUND[radius.argmin()] == pytest.approx(0, abs=1e-9)
    tip, root = np.abs(complex_points(profile, np.array([np.pi, 0.0])))
    assert (tip, root) == pytest.approx((profile.tip_radius, profile.root_radius), rel=1e-14)


@pytest.mark.parametrize("seed", SEEDS)
def test_normals_and_curvature_are_the_derivatives_of_the_points(seed):
    generator = np.random.default_rng(seed)
    stage = random_cycloid_stage(generator)
    profile = ToothProfile(stage=stage, modification=random_modification(stage, generator))
    first, second = derivatives(profile, AROUND)
    # With growing φ the disc lies to the right of its profile.
    np.testing.assert_allclose(profile.normals(AROUND) @ [1, 1j], -1j * first / np.abs(first), rtol=0, atol=1e-10)
    bend = -(first.conj() * second).imag / np.abs(first) ** 3
    np.testing.assert_allclose(profile.curvature(AROUND), bend, rtol=1e-6, atol=1e-6 / stage.pin_circle_radius)


@pytest.mark.parametrize("seed", SEEDS)
def test_curvature_changes_sign_at_the_inflection_alone(seed):
    generator = np.random.default_rng(seed)
    stage = random_cycloid_stage(generator)
    profile = ToothProfile(stage=stage, modification=random_modification(stage, generator))
    at = profile.inflection_angle
    ground = replace(stage, pin_circle_radius=stage.pin_circle_radius + profile.modification.shift)
    assert at == pytest.approx(brentq(lambda angle: path_bend(ground, angle), 0.0, np.pi, xtol=1e-14), abs=1e-12)
    concave, convex = np.linspace(0, at - 1e-9, 500), np.linspace(at + 1e-9, np.pi, 500)
    assert (profile.curvature(concave) < 0).all()
    assert (profile.curvature(convex) > 0).all()
    assert abs(profile.curvature(np.array([at]))[0]) < 1e-10 / stage.pin_circle_radius


def test_teeth_of_a_tiny_eccentricity_are_convex_all_over():
    """The path of a pin's centre has inflections only where K1 is above 1/zp."""
    stage = replace(any_stage(np.random.default_rng(1)), pin_radius=1e-3)
    for shortening, convex in ((0.99 / stage.pin_count, True), (1.01 / stage.pin_count, False)):
        own = replace(stage, eccentricity=shortening * stage.pin_circle_radius / stage.pin_count)
        profile = ToothProfile(stage=own)
        assert (profile.inflection_angle == 0.0) is convex
        assert bool(path_bend(own, 0.0) > 0) is convex
        assert bool(profile.curvature(np.zeros(1))[0] > 0) is convex


def test_smallest_convex_radius_is_that_of_a_dense_scan():
    generator, at_tips = np.random.default_rng(20191015), 0
    around = np.linspace(0, np.pi, 2001)
    for _ in range(500):
        stage = any_stage(generator)
        sharpest = int(np.argmax(path_bend(stage, around)))
        at_tips += sharpest == around.size - 1
        window = around[max(sharpest - 1, 0)], around[min(sharpest + 1, around.size - 1)]
        found = minimize_scalar(lambda angle, own=stage: -path_bend(own, angle), bounds=window, method="bounded")
        largest = max(-found.fun, path_bend(stage, around).max())
        assert stage.smallest_convex_radius == pytest.approx(1 / largest, rel=1e-9)
    assert 50 < at_tips < 450, "the sharpest place is to be at the tip in some cases and on the flank in others"


@pytest.mark.parametrize("seed", range(20))
def test_a_pin_above_the_limit_undercuts_and_one_below_does_not(seed):
    """A cusp: the profile runs backwards. And what one pass of the pin leaves, another one takes away."""
    stage = random_cycloid_stage(np.random.default_rng(seed))
    around = np.linspace(0, np.pi, 40001)
    forward = np.diff(path(stage, around))
    for factor, cusped in ((0.999, False), (1.001, True)):
        own = replace(stage, pin_radius=factor * stage.smallest_convex_radius)
        chord = np.diff(complex_points(ToothProfile(stage=own), around))
        assert ((chord * forward.conj()).real < 0).any() == cusped
        assert (ToothProfile(stage=own).curvature(around).min() < -1 / own.pin_radius) == cusped
        if cusped:
            with pytest.raises(InputError, match=r"^here: the grinding pin of radius .* undercuts the teeth; .*\.$"):
                require_sound(ToothProfile(stage=own), "here")
        else:
            require_sound(ToothProfile(stage=own), "here")
    centres = path(stage, np.linspace(0, 2 * np.pi, 20001))
    for factor, cut in ((0.99, False), (1.05, True)):
        own = replace(stage, pin_radius=factor * stage.smallest_convex_radius)
        points = complex_points(ToothProfile(stage=own), np.linspace(0.5, np.pi, 400))
        cleared = np.array([np.abs(point - centres).min() for point in points]) - own.pin_radius
        assert (cleared.min() < -1e-5 * own.pin_radius) == cut, "a point of the profile lies inside another pass"


@pytest.mark.parametrize("seed", SEEDS)
def test_teeth_are_alike_and_mirror_symmetric(seed):
    generator = np.random.default_rng(seed)
    stage = random_cycloid_stage(generator)
    amounts = replace(random_modification(stage, generator), rotation=0.0)
    profile = ToothProfile(stage=stage, modification=amounts)
    points, rounding = complex_points(profile, AROUND), 100 * np.spacing(stage.pin_circle_radius)
    np.testing.assert_allclose(complex_points(profile, -AROUND), points.conj(), rtol=0, atol=rounding)
    pitch = np.exp(-2j * np.pi / stage.disc_teeth)
    np.testing.assert_allclose(complex_points(profile, AROUND + 2 * np.pi), points * pitch, rtol=0, atol=rounding)
    whole_turn = complex_points(profile, AROUND + 2 * np.pi * stage.disc_teeth)
    np.testing.assert_allclose(whole_turn, points, rtol=0, atol=stage.disc_teeth * rounding)
    np.testing.assert_allclose(profile.curvature(-AROUND), profile.curvature(AROUND), rtol=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_rotation_turns_a_flank_towards_the_middle_of_its_tooth(seed):
    """The tooth of the flank 0 ≤ φ ≤ π has its middle at −π/zc: the flank goes clockwise, the root opens by 2δ."""
    stage = random_cycloid_stage(np.random.default_rng(seed))
    amounts = Modification(equidistant=0.0, shift=0.0, rotation=1e-4)
    before = complex_points(ToothProfile(stage=stage), AROUND)
    after = complex_points(ToothProfile(stage=stage, modification=amounts), AROUND)
    np.testing.assert_allclose(np.angle(after / before), -1e-4, rtol=0, atol=1e-15)
    middle = np.angle(complex_points(ToothProfile(stage=stage), np.array([np.pi])))[0]
    assert middle == pytest.approx(-np.pi / stage.disc_teeth, abs=1e-14)


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"eccentricity": 1.7e-3}, r"K1 = eccentricity·pin_count/pin_circle_radius is 1\.06.*; allowed is below 1\.$"),
        ({"pin_radius": -1e-3}, r"radius -1 mm undercuts"),
    ],
)
def test_profiles_that_no_pin_can_grind_are_refused(change, what):
    stage = CycloidStage(
        pin_count=40, disc_teeth=39, pin_circle_radius=0.064, pin_radius=0.003, eccentricity=1.3e-3, face_width=0.012
    )
    require_sound(ToothProfile(stage=stage), "here")
    with pytest.raises(InputError, match=what):
        require_sound(ToothProfile(stage=replace(stage, **change)), "here")

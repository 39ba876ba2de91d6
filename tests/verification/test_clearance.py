"""Clearances between pins and modified teeth against a brute-force search; what is asked for against what is left."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.random_cases import random_cycloid_stage, seeds
from tests.verification.distance_search import grindable, places, random_amounts, searched, searched_between
from tests.verification.test_tooth_profile import path_bend
from tolalloc.exceptions import InputError
from tolalloc.reading.units import DEGREE, MICROMETRE, MILLIMETRE
from tolalloc.reducers.cycloid.clearance import (
    LARGE,
    clearance_of,
    exact_clearance,
    formula_gap,
    is_large,
    linear_clearance,
)
from tolalloc.reducers.cycloid.tooth_profile import ToothProfile, require_sound
from tolalloc.reducers.reducer.design import CycloidStage, Modification
from tolalloc.reducers.reducer.files import load_reducer

NANOMETRE_MILLIONTH = 1e-12  # 1e-9 mm
FLANK = np.linspace(0.0, np.pi, 181)
SONG2019 = CycloidStage(
    pin_count=40, disc_teeth=39, pin_circle_radius=0.082, pin_radius=0.005, eccentricity=1.5e-3, face_width=0.01
)


@pytest.mark.parametrize("seed", range(10))
def test_exact_distances_are_those_of_a_search(seed):
    """100 designs of each seed; the disc stands still or turns by up to a tenth of its pitch."""
    generator, designs = np.random.default_rng([2019, seed]), 0
    while designs < 100:
        stage, amounts = random_cycloid_stage(generator), random_amounts(generator)
        if not grindable(stage, amounts):
            continue
        designs += 1
        pins = places(stage, amounts, generator)
        turned = generator.choice([0.0, 1.0]) * generator.uniform(-0.1, 0.1) * 2 * np.pi / stage.disc_teeth
        found = exact_clearance([ToothProfile(stage=stage, modification=amounts)], pins, turned)[0]
        expected = searched(stage, amounts, pins, turned)
        assert np.abs(found - expected).max() < NANOMETRE_MILLIONTH, (stage, amounts, pins, turned)


@pytest.mark.slow
def test_many_profiles_at_once_are_each_alone(generator):
    stages = [random_cycloid_stage(generator) for _ in range(30)]
    profiles = [ToothProfile(stage=stage, modification=random_amounts(generator)) for stage in stages]
    pins, turned = generator.uniform(-np.pi, np.pi, 7), generator.uniform(-1e-4, 1e-4, (30, 7))
    together = exact_clearance(profiles, pins, turned)
    for profile, own, row in zip(profiles, turned, together, strict=True):
        assert np.array_equal(exact_clearance([profile], pins, own)[0], row)
        one_by_one = [exact_clearance([profile], pins[[k]], own[k])[0, 0] for k in range(7)]
        assert np.array_equal(one_by_one, row)


@pytest.mark.parametrize("seed", range(20))
def test_flanks_turned_towards_the_middle_of_their_tooth(seed):
    """All around, the edges at root and tip included."""
    generator = np.random.default_rng([5, seed])
    stage = random_cycloid_stage(generator)
    amounts = Modification(
        equidistant=generator.uniform(0, 50) * MICROMETRE,
        shift=generator.uniform(-50, 0) * MICROMETRE,
        rotation=generator.uniform(1, 50) * MICROMETRE / stage.disc_pitch_radius,
    )
    pins = generator.uniform(45, 160, 12) * DEGREE * generator.choice([-1, 1], 12)
    pins = np.concatenate([pins, [0.0, 1e-3, 0.03, 0.2, 3.0, 3.14, np.pi]])
    profile = ToothProfile(stage=stage, modification=amounts)
    expected = searched_between(stage, amounts, pins)
    np.testing.assert_allclose(exact_clearance([profile], pins)[0], expected, rtol=0, atol=NANOMETRE_MILLIONTH)
    # Turning the disc either way closes one side and opens the other by the same.
    counter_clockwise = exact_clearance([profile], pins, 1e-5)[0]
    np.testing.assert_allclose(exact_clearance([profile], -pins, -1e-5)[0], counter_clockwise, rtol=0, atol=1e-15)


@pytest.mark.parametrize("pin_angle", [0.0, 1.0, 2.0, 178.0, 180.0])
def test_edges_at_root_and_tip_of_turned_flanks(pin_angle):
    """At the root both positions leave a ridge in the middle, which the pin meets 9.5 µm early."""
    stage = load_reducer("rv40e_xi2015").cycloid_stage
    amounts = Modification(equidistant=0.0, shift=0.0, rotation=200 * MICROMETRE / stage.disc_pitch_radius)
    pins = np.array([pin_angle * DEGREE])
    found = exact_clearance([ToothProfile(stage=stage, modification=amounts)], pins)[0]
    np.testing.assert_allclose(found, searched_between(stage, amounts, pins), rtol=0, atol=NANOMETRE_MILLIONTH)


@pytest.mark.parametrize("seed", seeds(30))
def test_linear_formula_is_right_to_second_order(seed):
    """Away from the root, where the path of a pin bends so much that amounts of micrometres are not small."""
    generator = np.random.default_rng([35, seed])
    stage, pins = random_cycloid_stage(generator), np.linspace(60, 175, 30) * DEGREE
    share = generator.uniform(-1, 1, 3)
    pins *= generator.choice([-1, 1])

    def error(size: float) -> np.ndarray:
        amounts = Modification(
            equidistant=share[0] * size, shift=share[1] * size, rotation=abs(share[2]) * size / stage.disc_pitch_radius
        )
        profile = ToothProfile(stage=stage, modification=amounts)
        return exact_clearance([profile], pins)[0] - linear_clearance(stage, amounts, pins)

    whole, half = error(10 * MICROMETRE), error(5 * MICROMETRE)
    assert np.abs(whole).max() > 1e-12, "the error would be rounding"
    assert np.abs(whole - 4 * half).max() < 0.05 * np.abs(whole).max()
    assert np.abs(whole).max() < 0.2 * MICROMETRE


def second_order(stage: CycloidStage, amounts: Modification, turned: float, pin_angle: np.ndarray) -> np.ndarray:
    """How much the linear formula may be off [m].

    A slip τ along the path of the pin adds τ²κ/2, and up to τ²/(Rp√s) as the normal turns; κ may be larger nearby.
    Turned flanks meet in edges, which lie below the tooth's own curve by τ²/2 times the curvature of the tooth.
    """
    slip = abs(amounts.shift) + (abs(turned) + abs(amounts.rotation)) * stage.pin_circle_radius
    root = np.sqrt(1 + stage.shortening**2 - 2 * stage.shortening * np.cos(pin_angle))
    bend = path_bend(stage, pin_angle)
    edge = np.abs(bend / (1 - stage.pin_radius * bend)) if amounts.rotation else 0.0
    return slip**2 * (np.abs(bend) + edge + 1 / (stage.pin_circle_radius * root)) + 1e-15


def asked_modifications(
    stage: CycloidStage, generator: np.random.Generator
) -> dict[str, tuple[Modification, float, float]]:
    """Mode → amounts, and the clearances on the flank and at tip and root that they are to deliver [m]."""
    flank, radial, turned = generator.uniform(2, 12, 3) * MICROMETRE
    ratio = np.sin(np.arccos(stage.eccentricity * stage.pin_count / stage.pin_circle_radius))
    lever = stage.eccentricity * stage.disc_teeth
    both = Modification.from_clearances(flank, radial, stage)
    return {
        "equidistant": (Modification(equidistant=flank, shift=0.0), flank, flank),
        "shift": (Modification(equidistant=0.0, shift=-radial), ratio * radial, radial),
        "equidistant and negative shift": (
            Modification(equidistant=flank, shift=-radial),
            flank + ratio * radial,
            flank + radial,
        ),
        "from clearances": (both, flank, radial),
        "rotation": (Modification(equidistant=0.0, shift=0.0, rotation=turned / lever), turned, 0.0),
        "from clearances and rotation": (replace(both, rotation=turned / lever), flank + turned, radial),
    }


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("mode", asked_modifications(SONG2019, np.random.default_rng(0)))  # the names alone
def test_what_is_asked_for_is_delivered_and_nothing_overlaps(mode, seed):
    stage = random_cycloid_stage(np.random.default_rng([6, seed]))
    amounts, flank, radial = asked_modifications(stage, np.random.default_rng([7, seed]))[mode]
    profile = ToothProfile(stage=stage, modification=amounts)
    require_sound(profile, "here")
    assert amounts.flank_clearance(stage) == pytest.approx(flank, abs=1e-18)
    assert amounts.radial_clearance == pytest.approx(radial, abs=1e-18)

    measured = searched_between if amounts.rotation else searched
    phi0 = np.arccos(stage.eccentricity * stage.pin_count / stage.pin_circle_radius)
    special = np.array([0.0, phi0, np.pi])
    allowed = second_order(stage, amounts, 0.0, special)
    off = measured(stage, amounts, special) - [radial, flank, radial]
    assert (np.abs(off) < allowed).all()
    if not amounts.rotation:
        assert np.abs(off[[0, 2]]).max() < 1e-15, "root and tip are circles about the same centres"
    # All pins at six phases; clockwise closes the other flank in the same way.
    pins = 2 * np.pi / stage.pin_count * (np.arange(stage.pin_count)[:, np.newaxis] + np.arange(6) / 6).ravel() - np.pi
    before = measured(stage, amounts, pins)
    assert (before > -second_order(stage, amounts, 0.0, pins)).all()
    closing = clearance_of(profile, exact=False).rotation
    allowed = second_order(stage, amounts, closing, pins)
    for direction in (1, -1):
        after = measured(stage, amounts, pins, direction * closing)
        assert (after > -allowed).all()
    # The first contact is where the flank clearance was asked for, if the flank is the narrowest place for a rotation.
    if amounts.equidistant * stage.flank_ratio >= amounts.shift and radial > 0:
        assert closing == pytest.approx(flank / stage.disc_pitch_radius, rel=1e-9)
        at_flank = measured(stage, amounts, special[[1]], closing)
        assert np.abs(at_flank) < second_order(stage, amounts, closing, special[[1]])


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize(
    ("equidistant", "shift", "rotation", "where"),
    [
        (-1.0, 0.0, 0.0, "tip and root"),
        (0.0, 1.0, 0.0, "tip and root"),
        (-1.0, -1.1, 0.0, "the flank"),
        (0.0, 0.0, -1.0, "the flank"),
    ],
)
def test_opposite_signs_overlap_and_are_refused(seed, equidistant, shift, rotation, where):
    generator = np.random.default_rng([8, seed])
    stage, size = random_cycloid_stage(generator), generator.uniform(2, 12) * MICROMETRE
    amounts = Modification(
        equidistant=equidistant * size, shift=shift * size, rotation=rotation * size / stage.disc_pitch_radius
    )
    profile = ToothProfile(stage=stage, modification=amounts)
    if where == "the flank" and not rotation:
        assert amounts.radial_clearance > 0  # the shift opens the flank by q = 0.53 to 0.87 of itself only
    with pytest.raises(InputError, match=rf"^mine: the modification is an interference of .* µm at {where};") as caught:
        require_sound(profile, "mine")
    sentence = str(caught.value)
    assert sentence.endswith(".")
    assert ". " not in sentence
    assert "\n" not in sentence
    with pytest.raises(InputError, match=r"^modification: interference of .* µm with the pin at .*°; allowed is .*\.$"):
        clearance_of(profile, exact=False)
    if not rotation:  # a grinding pin turned either way takes material away whatever the sign
        pins = np.linspace(-np.pi, np.pi, 73)
        least = min(amounts.radial_clearance, amounts.flank_clearance(stage))
        found = searched(stage, amounts, pins).min()
        assert found < 0.9 * least
        with pytest.raises(InputError, match="interference"):
            clearance_of(profile, exact=True)


def test_flanks_turned_away_from_the_middle_of_their_tooth():
    """The flank of a tooth made thicker by δ·r_d has that much less clearance, exactly as by the formula."""
    stage = load_reducer("rv40e_xi2015").cycloid_stage
    amounts = Modification(equidistant=20e-6, shift=0.0, rotation=-10e-6 / stage.disc_pitch_radius)
    profile = ToothProfile(stage=stage, modification=amounts)
    require_sound(profile, "mine")
    assert clearance_of(profile, exact=True).rotation == pytest.approx(clearance_of(profile, False).rotation, rel=0.01)


def test_backlash_of_turned_flanks_alone():
    """Every pin of a flank touches when the disc has turned by δ, but for those without lever at root and tip."""
    stage, turned = load_reducer("rv40e_xi2015").cycloid_stage, 1e-4
    profile = ToothProfile(stage=stage, modification=Modification(equidistant=0.0, shift=0.0, rotation=turned))
    assert clearance_of(profile, exact=False).free_rotation == pytest.approx(2 * turned, rel=1e-9)


@pytest.mark.parametrize("exact", [False, True])
def test_backlash_of_turned_flanks_with_clearance_at_the_root(exact):
    """The ridge between two positions of a root is 9.5 µm high here; 10 µm all around leave room for it."""
    stage = load_reducer("rv40e_xi2015").cycloid_stage
    amounts = Modification(equidistant=10e-6, shift=0.0, rotation=200e-6 / stage.disc_pitch_radius)
    found = clearance_of(ToothProfile(stage=stage, modification=amounts), exact=exact)
    assert found.free_rotation * stage.disc_pitch_radius == pytest.approx(420e-6, abs=0.1e-6)
    around = np.concatenate([[found.first_contact], found.pin_angle])
    if exact:
        after = searched_between(stage, amounts, around, found.rotation)
        assert abs(after[0]) < NANOMETRE_MILLIONTH
        assert after.min() > -NANOMETRE_MILLIONTH


def test_conventions_of_the_sources():
    """xi2015 prints −2 and +8 µm: with its own Rp − Δr_p 6 µm of radial clearance, with Rp + Δr_p an interference."""
    stage = load_reducer("rv40e_xi2015").cycloid_stage
    minus = Modification.from_convention("minus", equidistant=-2e-6, shift=8e-6)
    plus = Modification.from_convention("plus", equidistant=-2e-6, shift=8e-6)
    assert (minus.equidistant, minus.shift) == (-2e-6, -8e-6)
    assert (plus.equidistant, plus.shift) == (-2e-6, 8e-6)
    tip = np.array([np.pi])
    assert searched(stage, minus, tip)[0] == pytest.approx(6e-6, abs=1e-15)
    assert searched(stage, plus, tip)[0] == pytest.approx(-10e-6, abs=1e-15)
    require_sound(ToothProfile(stage=stage, modification=minus), "mine")
    with pytest.raises(InputError, match='say so by convention = "minus"'):
        require_sound(ToothProfile(stage=stage, modification=plus), "mine")
    with pytest.raises(KeyError):
        Modification.from_convention("neither", equidistant=0.0, shift=0.0)


@pytest.mark.parametrize("seed", seeds(40))
def test_first_contact_of_the_linear_clearance(seed):
    """At φ0 where Δr_rp·q ≥ Δr_p; else where cos κ = Δr_p/Δr_rp, which two pins reach at once.

    The rotation that pin φ allows is (Δr_rp − Δr_p·C)/(r_d·S) with C² + K1²S² = 1, so both roots of C have the same.
    """
    generator = np.random.default_rng([40, seed])
    stage, equidistant = random_cycloid_stage(generator), generator.uniform(1, 40) * MICROMETRE
    k1 = stage.eccentricity * stage.pin_count / stage.pin_circle_radius
    lever, q = stage.eccentricity * stage.disc_teeth, np.sqrt(1 - k1**2)
    for shift, elsewhere in (
        (generator.uniform(-1, q) * equidistant, False),
        (q * equidistant, False),
        (generator.uniform(q + 0.02, 0.99) * equidistant, True),
    ):
        amounts = Modification(equidistant=equidistant, shift=shift)
        found = clearance_of(ToothProfile(stage=stage, modification=amounts), exact=False)
        closing = k1 * np.sqrt(equidistant**2 - shift**2) / lever if elsewhere else (equidistant - shift * q) / lever
        assert found.rotation == pytest.approx(closing, rel=1e-9)
        assert found.free_rotation == pytest.approx(2 * closing, rel=1e-9)
        assert found.radial == equidistant - shift
        assert found.exact is False
        cosine = shift / equidistant if elsewhere else q
        at = np.cos(found.first_contact)
        assert (1 - k1 * at) / np.sqrt(1 + k1**2 - 2 * k1 * at) == pytest.approx(cosine, abs=1e-6)
        # A minimum is flat, and nothing but rounding tells its place.
        assert np.sin(found.first_contact) > 0
        assert found.after.min() > -1e-13
        gap = formula_gap(stage, amounts, found.pin_angle)
        np.testing.assert_array_equal(found.formula, gap)
        sine = np.sin(found.pin_angle) / np.sqrt(1 + k1**2 - 2 * k1 * np.cos(found.pin_angle))
        np.testing.assert_allclose(found.before - found.after, lever * sine * closing, rtol=0, atol=1e-15)
        if elsewhere:
            assert gap.min() < -1e-10, "closed at φ0 the disc would overlap pins elsewhere"
        else:
            np.testing.assert_allclose(found.after, gap, rtol=0, atol=1e-15)
            assert found.formula_error < 1e-15


@pytest.mark.parametrize("seed", range(12))
def test_first_contact_of_exact_teeth(seed):
    """Turned by the rotation that is answered, the nearest of all pins touches, and it is the one that is named."""
    generator = np.random.default_rng([41, seed])
    stage = random_cycloid_stage(generator)
    equidistant = 10 ** generator.uniform(-5, -3.5)
    amounts = Modification(equidistant=equidistant, shift=generator.uniform(-1, 0.9) * equidistant)
    if not grindable(stage, amounts):
        pytest.skip("the grinding pin would undercut")
    found = clearance_of(ToothProfile(stage=stage, modification=amounts), exact=True)
    around = np.concatenate([[found.first_contact], np.linspace(0, np.pi, 401)])
    gap = searched(stage, amounts, around, found.rotation)
    assert gap.min() > -NANOMETRE_MILLIONTH
    assert abs(gap[0]) < NANOMETRE_MILLIONTH
    np.testing.assert_allclose(found.after, searched(stage, amounts, found.pin_angle, found.rotation), atol=1e-12)


def test_song2019s_optimum_touches_far_from_where_the_formula_closes_it():
    amounts = Modification(equidistant=0.64986 * MILLIMETRE, shift=0.51982 * MILLIMETRE)
    profile = ToothProfile(stage=SONG2019, modification=amounts)
    require_sound(profile, "song2019")
    exact, linear = clearance_of(profile), clearance_of(profile, exact=False)
    assert exact.exact
    assert exact.formula.min() / MICROMETRE == pytest.approx(-8.4, abs=0.05)
    assert np.arccos(SONG2019.shortening) / DEGREE == pytest.approx(43.0, abs=0.05)
    assert exact.first_contact / DEGREE == pytest.approx(87.6, abs=0.05)
    # By the linear formula two pins touch at once, this one and one near the root.
    lever = np.sqrt(1 - (0.51982 / 0.64986) ** 2) / SONG2019.shortening
    both = [brentq(lambda at: _lever(at) - lever, *ends) for ends in ((0.0, 0.7), (0.8, np.pi))]
    assert both[1] / DEGREE == pytest.approx(88.0, abs=0.05)
    assert min(abs(linear.first_contact - place) for place in both) < 1e-6
    closed = searched(SONG2019, amounts, exact.pin_angle, exact.rotation)
    assert closed.min() > -NANOMETRE_MILLIONTH
    assert exact.pin_angle[closed.argmin()] / DEGREE == pytest.approx(87.6, abs=0.2)


def _lever(angle: float) -> float:
    k1 = SONG2019.shortening
    return float(np.sin(angle) / np.sqrt(1 + k1**2 - 2 * k1 * np.cos(angle)))


def test_rv40e_by_formula_and_exactly():
    reducer = load_reducer("rv40e_xi2015")
    stage = reducer.cycloid_stage
    profile = ToothProfile(stage=stage, modification=reducer.modification)
    found, linear = clearance_of(profile, exact=True), clearance_of(profile)
    assert not linear.exact
    assert linear.free_rotation == pytest.approx(2 * (-2e-6 + 8e-6 * np.sqrt(1 - 0.8125**2)) / (1.3e-3 * 39), rel=1e-12)
    assert linear.first_contact == pytest.approx(np.arccos(0.8125), abs=1e-6)
    # Closed at φ0, as the formula does, the exact distances differ from it by this much.
    fine = np.radians(np.arange(0, 180.05, 0.1))
    difference = searched(stage, reducer.modification, fine, linear.rotation) - formula_gap(
        stage, reducer.modification, fine
    )
    assert np.abs(difference).max() / MICROMETRE == pytest.approx(0.194, abs=0.0005)
    assert fine[np.abs(difference).argmax()] / DEGREE == pytest.approx(5.6, abs=0.05)
    assert found.formula_error / MICROMETRE == pytest.approx(0.194, abs=0.0005)
    assert found.formula.max() / MICROMETRE == pytest.approx(6.0, abs=1e-9)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("amount", ["equidistant", "shift", "rotation"])
def test_modifications_above_50_um_are_large(amount, sign):
    stage = load_reducer("rv40e_xi2015").cycloid_stage
    unit = 1 / stage.disc_pitch_radius if amount == "rotation" else 1.0
    assert pytest.approx(50e-6, rel=1e-12) == LARGE
    for size, large in ((49.9e-6, False), (50.1e-6, True)):
        amounts = replace(Modification(equidistant=0.0, shift=0.0), **{amount: sign * size * unit})
        assert is_large(stage, amounts) is large
    just_below, just_above = (
        Modification(equidistant=size, shift=-size) for size in (49.9 * MICROMETRE, 50.1 * MICROMETRE)
    )
    for amounts, exact in ((just_below, False), (just_above, True)):
        profile = ToothProfile(stage=stage, modification=amounts)
        assert clearance_of(profile).exact is exact
        assert clearance_of(profile, exact=not exact).exact is not exact


def test_a_profile_without_modification_has_no_clearance():
    for exact in (False, True):
        found = clearance_of(ToothProfile(stage=SONG2019), exact=exact)
        assert found.rotation == found.free_rotation == found.radial == 0.0
        assert np.abs(found.after).max() < 1e-15

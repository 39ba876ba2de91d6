import numpy as np
import pytest

from tolalloc.drawings.ladder import GRADES, SIZE_STEPS, ZONES, Ladder, fit_deviations, grade_zones, group_ladder
from tolalloc.drawings.sources import Source
from tolalloc.drawings.tolerance_table import load_tolerance_table
from tolalloc.drawings.zones import Feature
from tolalloc.exceptions import InputError

UM, MM = 1e-6, 1e-3

# One row per size step, IT01 to IT18 [µm]: the table of the standard read the other way than the package holds it.
PRINTED = """
0.3 0.5 0.8 1.2 2   3  4  6  10 14 25  40  60  100 140 250  400  600  1000 1400
0.4 0.6 1   1.5 2.5 4  5  8  12 18 30  48  75  120 180 300  480  750  1200 1800
0.4 0.6 1   1.5 2.5 4  6  9  15 22 36  58  90  150 220 360  580  900  1500 2200
0.5 0.8 1.2 2   3   5  8  11 18 27 43  70  110 180 270 430  700  1100 1800 2700
0.6 1   1.5 2.5 4   6  9  13 21 33 52  84  130 210 330 520  840  1300 2100 3300
0.6 1   1.5 2.5 4   7  11 16 25 39 62  100 160 250 390 620  1000 1600 2500 3900
0.8 1.2 2   3   5   8  13 19 30 46 74  120 190 300 460 740  1200 1900 3000 4600
1   1.5 2.5 4   6   10 15 22 35 54 87  140 220 350 540 870  1400 2200 3500 5400
1.2 2   3.5 5   8   12 18 25 40 63 100 160 250 400 630 1000 1600 2500 4000 6300
2   3   4.5 7   10  14 20 29 46 72 115 185 290 460 720 1150 1850 2900 4600 7200
2.5 4   6   8   12  16 23 32 52 81 130 210 320 520 810 1300 2100 3200 5200 8100
3   5   7   9   13  18 25 36 57 89 140 230 360 570 890 1400 2300 3600 5700 8900
4   6   8   10  15  20 27 40 63 97 155 250 400 630 970 1550 2500 4000 6300 9700
"""
TABLE = [[float(value) for value in line.split()] for line in PRINTED.strip().splitlines()]


def source(name="size", **changes):
    own = {"part": "pin", "feature": Feature.SIZE, "zone": 5 * UM, "minimum": 1 * UM, "maximum": 20 * UM, "cost": 1.0}
    return Source(name=name, **{**own, **changes})


@pytest.mark.parametrize(("largest", "row"), [*zip(SIZE_STEPS, TABLE, strict=True)])
def test_all_zones_are_the_printed_ones_at_both_ends_of_the_size_step(largest, row):
    smallest = 1.01 if largest == 3 else SIZE_STEPS[SIZE_STEPS.index(largest) - 1] + 0.001
    for nominal in (smallest, largest):
        np.testing.assert_allclose([*grade_zones(nominal * MM).values()], np.array(row) * UM, rtol=1e-12)
    assert tuple(grade_zones(largest * MM)) == GRADES


def test_printed_zones_follow_the_formula_as_far_as_the_standard_rounds_them():
    ends = np.array([1, *SIZE_STEPS], float)
    mean = np.sqrt(ends[:-1] * ends[1:])
    unit = 0.45 * np.cbrt(mean) + 0.001 * mean
    factors = (7, 10, 16, 25, 40, 64, 100, 160, 250, 400, 640, 1000, 1600, 2500)
    fine = [0.3 + 0.008 * mean, 0.5 + 0.012 * mean, 0.8 + 0.02 * mean]
    middle = [fine[2] * (7 * unit / fine[2]) ** (power / 4) for power in (1, 2, 3)]
    formula = np.array([*fine, *middle, *(factor * unit for factor in factors)]).T
    apart = np.abs(np.array(TABLE) / formula - 1)
    assert apart[:, :6].max() < 0.29  # IT01 to IT4, rounded to few preferred numbers
    assert apart[:, 6:].max() < 0.16
    assert apart[1:, 6:].max() < 0.10
    assert np.median(apart[:, 6:]) < 0.02


def test_sizes_outside_the_standard_are_refused():
    for nominal in (0.0, -1 * MM, 500.1 * MM, float("nan")):
        with pytest.raises(InputError, match="nominal"):
            grade_zones(nominal)
    up_to_one = grade_zones(1 * MM)
    assert (*up_to_one,) == tuple(grade for grade in GRADES if grade not in ("IT14", "IT15", "IT16", "IT17", "IT18"))
    assert up_to_one["IT13"] == pytest.approx(140 * UM)


def test_preferred_zones_grow_evenly_and_stay_near_the_geometric_series():
    exact = 0.1 * 10 ** (np.arange(41) / 10)
    assert (ZONES / UM)[[0, 5, 10, -1]] == pytest.approx([0.1, 0.32, 1, 1000])
    assert np.abs(ZONES / UM / exact - 1).max() < 0.025
    assert np.all(np.diff(ZONES) > 0)


def test_a_size_climbs_its_grades_and_anything_else_the_preferred_zones():
    size = group_ladder([source(nominal=4 * MM)])
    assert size.labels == ("IT1", "IT2", "IT3", "IT4", "IT5", "IT6", "IT7", "IT8")
    np.testing.assert_allclose(size.zones / UM, [1, 1.5, 2.5, 4, 5, 8, 12, 18])
    for other in (source(), source(feature=Feature.POSITION, nominal=4 * MM)):
        ladder = group_ladder([other])
        assert set(ladder.labels) == {"R′10"}
        assert len(ladder.labels) == len(ladder.zones)
        np.testing.assert_allclose(ladder.zones[[0, 5, -1]] / UM, [1, 3.2, 20])


def test_radii_have_no_grades():
    table = {own.name: own for own in load_tolerance_table("rv20e_all_sources")}
    labels = {name: set(group_ladder([table[name]]).labels) for name in table}
    assert labels["housing.groove.radius"] == labels["each_pin.groove"] == {"R′10"}
    graded = {name for name, own in labels.items() if own != {"R′10"}}
    assert graded == {"pin.diameter", "each_pin.diameter"}


def test_a_ladder_needs_increasing_zones():
    for zones in ((), (0.0, 1 * UM), (float("nan"),), (2 * UM, 1 * UM)):
        with pytest.raises(InputError, match="zones"):
            Ladder(zones=np.array(zones, dtype=float), labels=("own",) * len(zones))


def test_a_locked_source_has_no_ladder():
    with pytest.raises(InputError, match="locked"):
        group_ladder((source(locked=True), source()))


def test_a_range_without_a_step_names_the_nearest_steps():
    with pytest.raises(InputError, match=r"source size: min and max.*\(2.6, 3.9\).*IT3 \(2.5 µm\) and IT4 \(4 µm\)"):
        group_ladder([source(nominal=4 * MM, minimum=2.6 * UM, maximum=3.9 * UM, zone=3 * UM)])
    with pytest.raises(InputError, match=r"nearest of which are IT01 \(0.4 µm\)\."):
        group_ladder([source(nominal=4 * MM, minimum=0.1 * UM, maximum=0.3 * UM, zone=0.2 * UM)])
    with pytest.raises(InputError, match=r"nearest of which are R′10 \(1000 µm\)"):
        group_ladder([source(minimum=1100 * UM, maximum=1200 * UM, zone=1150 * UM)])


def test_members_of_a_group_share_one_zone_inside_the_ranges_of_all():
    table = load_tolerance_table("rv20e_table4")
    bores = [source for source in table if source.group == "disc bores"]
    assert {round(bore.zone / UM, 3) for bore in bores} == {3.8, 4.0}
    ladder = group_ladder(bores)
    np.testing.assert_allclose(ladder.zones / UM, [0.63, 0.8, 1, 1.25, 1.6, 2, 2.5, 3.2, 4, 5, 6.3])
    alike = [source("a", nominal=20 * MM, group="g"), source("b", nominal=29 * MM, group="g")]
    assert group_ladder(alike).labels[:2] == ("IT0", "IT1")
    mixed = [source("a", nominal=20 * MM, group="g"), source("b", nominal=31 * MM, group="g")]
    assert group_ladder(mixed).labels[0] == "R′10"
    with pytest.raises(InputError, match="group g"):
        group_ladder([source("a", maximum=4 * UM, group="g"), source("b", minimum=4.5 * UM, group="g")])


PUBLISHED_FITS = {
    ("h5", 25): (0, -9),
    ("h01", 25): (0, -0.6),
    ("h1", 25): (0, -1.5),
    ("H7", 25): (21, 0),
    ("g6", 25): (-7, -20),
    ("f7", 60): (-30, -60),
    ("e8", 10): (-25, -47),
    ("d9", 100): (-120, -207),
    ("k6", 50): (18, 2),
    ("k8", 40): (39, 0),
    ("m6", 30): (21, 8),
    ("n6", 60): (39, 20),
    ("p6", 18): (29, 18),
    ("js6", 40): (8, -8),
    ("JS7", 40): (12.5, -12.5),
    ("IT6", 40): (8, -8),
    ("G7", 30): (28, 7),
    ("F8", 50): (64, 25),
    ("E9", 20): (92, 40),
    ("D10", 80): (220, 100),
    ("K6", 3): (0, -6),
    ("K7", 40): (7, -18),
    ("K8", 200): (22, -50),
    ("M6", 300): (-9, -41),
    ("M7", 40): (0, -25),
    ("M8", 60): (5, -41),
    ("N6", 5): (-5, -13),
    ("N7", 40): (-8, -33),
    ("N9", 3): (-4, -29),
    ("N9", 40): (0, -62),
    ("P6", 8): (-12, -21),
    ("P7", 40): (-17, -42),
    ("P9", 40): (-26, -88),
    ("H11", 400): (360, 0),
}
"""Fit and nominal size [mm] → upper and lower deviation [µm], as tables of ISO 286-2 print them."""


@pytest.mark.parametrize(("fit", "size"), PUBLISHED_FITS)
def test_deviations_of_a_fit_are_those_of_the_standard(fit, size):
    found = [one * 1e6 for one in fit_deviations(fit, size * 1e-3)]
    assert found == pytest.approx(PUBLISHED_FITS[fit, size], abs=1e-9)


@pytest.mark.parametrize("fit", ["z6", "K9", "K0", "P2", "h19", "h", "ZC8"])
def test_a_fit_that_is_not_known_is_refused(fit):
    with pytest.raises(InputError, match=f"ISO 286-2: fit is '{fit}'; allowed is"):
        fit_deviations(fit, 0.04)

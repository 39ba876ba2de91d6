"""Populations of parts against closed forms, and what a drawing says of the one that it promises for."""

from dataclasses import replace
from math import factorial, sqrt

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.stats import norm

import tolalloc as ta
from tolalloc.drawings.drawing import load_drawing
from tolalloc.drawings.population import ANYWHERE, EVENLY, demand, populated
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError
from tolalloc.study.prepared import Prepared

NAMES = ("a", "b", "c")
ROW = {"unit": "µm", "plus": 10, "minus": -10, "min": 2, "max": 60, "cost": 10.0, "step": 1e-6}
GAP = "gap [µm]"


def drawing(**more):
    own = {name: value for name, value in more.items() if name in ("population", "gauge_ratio")}
    row = ROW | {name: value for name, value in more.items() if name not in own}
    return ta.Drawing.of_rows([{"id": name, "nominal": 10.0, **row} for name in NAMES], **own)


def study(limit=20.0, signs=(1, 1, 1), show=None, **more):
    model = ta.model(
        lambda a, b, c: 1000 * (signs[0] * (a - 10) + signs[1] * (b - 10) + signs[2] * (c - 10)),
        inputs=dict.fromkeys(NAMES, 10.0),
        outputs=(GAP,),
    )
    asked, shown = [ta.Allocation(front=False, what_if=False)], {"show": show} if show else {}
    return ta.Study(model, drawing(**more), limits={GAP: ta.Limit(lower=-limit, upper=limit, **shown)}, questions=asked)


def beyond_sum_of_even_parts(count, half, limit):
    """Return the share of sums of evenly spread parts beyond ± a limit; Irwin and Hall (1927)."""
    reach = (count * half - limit) / (2 * half)
    terms = ((-1) ** k * (reach - k) ** count / (factorial(k) * factorial(count - k)) for k in range(int(reach) + 1))
    return 2 * sum(terms)


def zones_of(asked):
    return [own.zone * 1e6 for own in asked.allocate(effort="quick").result.drawn_sources]


def test_zones_of_evenly_spread_parts_are_those_of_irwin_and_hall():
    half = brentq(lambda half: beyond_sum_of_even_parts(3, half, 20.0) - 0.0027, 7.0, 12.0)
    assert zones_of(study(population=EVENLY)) == pytest.approx([2 * half] * 3, rel=2e-3)


def test_zones_of_parts_anywhere_in_them_are_those_of_the_worst_case():
    assert zones_of(study(population=ANYWHERE)) == pytest.approx([40 / 3] * 3, rel=1e-6)


@pytest.mark.parametrize("cp", [0.67, 1.33])
def test_zones_of_one_capability_are_those_of_the_root_sum_square(cp):
    sigma = 20.0 / norm.isf(0.00135) / sqrt(3)
    assert zones_of(study(population=cp)) == pytest.approx([6 * cp * sigma] * 3, rel=2e-3)


def test_zones_of_evenly_spread_parts_at_a_cpk_are_those_of_their_variance():
    """σ of the sum is the half zone, and mean + 3·Cpk·σ lies beyond all that such parts reach."""
    found = study(population=EVENLY, show=ta.AtCpk(target=1.33)).allocate(effort="quick").result
    half = 20.0 / (3 * 1.33)
    assert [own.zone * 1e6 / 2 for own in found.drawn_sources] == pytest.approx([half] * 3, rel=1e-2)
    assert found.cost == pytest.approx(3 * 10.0 * 10.0 / half, rel=2e-3)


def test_share_of_evenly_spread_parts_beside_the_promise_is_that_of_irwin_and_hall():
    result = study().allocate(effort="quick").result
    half = result.drawn_sources[0].zone * 1e6 / 2
    expected = 1 - beyond_sum_of_even_parts(3, half, 20.0)
    error = sqrt(expected * (1 - expected) / result.evenly.joint.units)
    assert abs(result.evenly.joint.estimate - expected) < 4 * error
    assert expected < 0.98 < result.chosen.achieved.estimate


def share_inside(limit, half=10.0, **row):
    """Return the share of sums of three parts of a half zone inside ± a limit [µm], and its standard error [-]."""
    errors = drawing(plus=half, minus=-half, **row).errors
    sums = (errors.random_units(20_000, SeedTree(8)) - errors.middles).sum(axis=1) * 1e6
    inside = float((np.abs(sums) <= limit).mean())
    return inside, sqrt(inside * (1 - inside) / len(sums))


def test_share_of_parts_at_either_limit_is_that_of_three_coins():
    """All three at one limit in one case of four; the zones of parts anywhere in them keep even those."""
    at_limits = {"distribution": "mixture", "batches": "0.5:-1:0.01 0.5:1:0.01"}  # σ 1 % of that at Cp 1
    inside, error = share_inside(20.0, **at_limits)
    assert abs(inside - 0.75) < 4 * error
    (half, *_) = (own / 2 for own in zones_of(study(population=ANYWHERE)))
    assert share_inside(20.0 + 3 * half * 4 * 0.01 / 3, half, **at_limits)[0] == 1.0
    assert share_inside(19.0, half, **at_limits)[0] < 0.8


@pytest.mark.parametrize("limit", [12.0, 15.0, 20.0])
def test_share_of_triangular_parts_in_the_upper_half_of_their_zones_is_that_of_irwin_and_hall(limit):
    """A triangular deviation from 0 to 10 µm is the sum of two even ones from 0 to 5."""
    inside, error = share_inside(limit, distribution="triangular", Cp=2.0, shift=0.5)
    terms = ((-1) ** k * (limit / 5 - k) ** 6 / (factorial(k) * factorial(6 - k)) for k in range(int(limit / 5) + 1))
    assert abs(inside - sum(terms)) < 4 * error


def test_even_spread_of_every_feature_fills_its_zone_and_no_more():
    errors = populated(load_drawing("rv20e_drawing").errors, EVENLY)
    units = errors.random_units(4000, SeedTree(3))
    for own, at in zip(errors.active, errors.columns_of_source, strict=True):
        if own.feature.value == "position" and own.each == 1:
            radius = np.hypot(*(units[:, at] * own.lever).T)
            assert radius.max() <= own.zone / 2 * (1 + 1e-9)
            assert radius.mean() == pytest.approx(own.zone / 4, rel=0.04)
        elif own.feature.value == "size":
            off = (units[:, at] - own.middles) * own.lever
            assert np.abs(off).max() <= own.zone / 2 * (1 + 1e-9)
            assert off.std() == pytest.approx(own.zone / sqrt(12), rel=0.04)


def test_population_of_every_row_is_lost_but_its_zone_and_price():
    stated = replace(drawing(Cp=1.33, shift=0.2), population=EVENLY)
    (first, *_), (before, *_) = stated.as_asked.sources, stated.sources
    assert (first.cp, first.shift, first.distribution.value) == (1.0, 0.0, "uniform")
    assert replace(first, cp=before.cp, shift=before.shift, distribution=before.distribution) == before


@pytest.mark.parametrize("bad", ["even", 0.05, 11, True, "Uniform", float("nan")])
def test_unknown_populations_are_refused_with_what_is_allowed(bad):
    with pytest.raises(InputError, match=r"population is .*; allowed is 'uniform', 'none', or a Cp from 0\.1 to 10"):
        drawing(population=bad)


def test_study_says_its_population_and_has_another_digest():
    asked = [Prepared(study=study(population=own)) for own in ("", EVENLY, ANYWHERE, 0.67)]
    assert len({own.digest for own in asked}) == len(asked)
    said = [" ".join(own.notes) for own in asked]
    assert "spread evenly" in said[1]
    assert "worst unit" in said[2]
    assert "Cp 0.67" in said[3]
    assert "Parts" not in said[0]


def test_demands_of_a_line_are_what_its_row_states():
    def of(**row):
        return demand(drawing(**row).sources[0])

    assert of() == "Cp ≥ 1, centred"
    assert of(Cp=1.33, shift=-0.2) == "Cp ≥ 1.33, mean 20% of the half zone below its middle"
    assert of(distribution="uniform") == "no more than evenly spread"
    assert of(distribution="triangular") == "Cp ≥ 1, centred, triangular"
    assert of(sorted=True, Cp=0.8) == "Cp ≥ 0.8, centred, all parts inspected"
    position = ta.Drawing.of_rows([{"id": "hole", "feature": "position", **ROW, "minus": 0}])
    assert demand(position.sources[0]) == "Cp ≥ 1"


def test_promise_names_a_mean_off_the_middle_only_as_what_lines_demand():
    answer = study(shift=0.3).allocate(effort="quick")
    (said,) = [own for own in answer.teller.sentences if "This holds for parts with" in own]
    assert "the mean and spread that each line demands" in said
    assert "Cp 1 about the middle" not in said


def test_promise_for_evenly_spread_parts_says_so():
    sentences = study(population=EVENLY).allocate(effort="quick").teller.sentences
    assert any("This holds for parts that are spread evenly over their zones." in own for own in sentences)


def test_drawing_for_parts_anywhere_in_their_zones_demands_the_zones_alone(tmp_path):
    answer = study(population=ANYWHERE).allocate(effort="quick")
    answer.teller.add_files(tmp_path)
    described = (tmp_path / "inspection.dfd").read_text(encoding="utf-8")
    assert described.count("K2900") == described.count("no demand beyond the zone") == 3
    assert not any("This holds for parts" in own for own in answer.teller.sentences)


def test_zones_opened_for_their_gauges_are_said():
    notes = Prepared(study=study(limit=30.0, uncertainty=2.5, gauge_ratio=10.0)).notes
    assert any("a 20 µm → 25 µm" in own for own in notes)
    assert not any("Opened" in own for own in Prepared(study=study(uncertainty=1.0, gauge_ratio=10.0)).notes)


def test_smallest_zones_are_those_that_gauges_resolve_and_open_ones_cost_as_one_over_the_zone():
    own = drawing(uncertainty=3.0, gauge_ratio=10.0).as_asked.sources[0]
    assert (own.minimum * 1e6, own.zone * 1e6, own.cost) == pytest.approx((30.0, 30.0, 10.0 * 20 / 30))
    assert own.is_resolved
    assert not drawing(uncertainty=3.0).sources[0].is_resolved
    assert drawing(uncertainty=1.0, gauge_ratio=10.0).as_asked.sources[0].zone == pytest.approx(20e-6)
    assert min(zones_of(study(limit=30.0, uncertainty=2.5, gauge_ratio=10.0))) >= 25.0 * (1 - 1e-9)


def test_zones_too_small_for_their_gauges_are_refused_by_name():
    with pytest.raises(InputError, match=r"drawing \(a\): max is '60 µm'; allowed is 70 µm or more"):
        _ = drawing(uncertainty=7.0, gauge_ratio=10.0).as_asked
    for bad in (-1, "10", float("nan"), True, 1000):
        with pytest.raises(InputError, match=f"gauge_ratio is {bad!r}; allowed is 0 to 100"):
            drawing(gauge_ratio=bad)


@pytest.mark.slow
def test_shipped_drawing_of_the_rv80e_keeps_what_parts_spread_evenly_leave_of_its_own_quantile():
    """95.0 % became 86.5 % of 600 reducers, and 67.5 % at Cp 0.67, in an independent count."""
    model, units = ta.reducer("rv80e"), 1000
    limits = {ta.PEAK_TO_PEAK: ta.Limit(upper=60.0)}
    asked = Prepared(study=ta.Study(model, ta.drawing("rv80e_drawing"), limits=limits))
    read = asked.model.reading((ta.PEAK_TO_PEAK,))

    def values(population):
        return read(populated(asked.errors, population).random_units(units, SeedTree(6))).values[:, 0]

    limit = np.quantile(values(""), 0.95)
    for population, counted in ((EVENLY, 0.865), (0.67, 0.675)):
        error = sqrt(counted * (1 - counted) * (1 / units + 1 / 600) + (0.0069 * 3) ** 2)  # and of the limit of each
        assert abs((values(population) < limit).mean() - counted) < 3 * error

"""What parts in the middle of their zones do: clearances, play of the whole reducer, and limits that they miss."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tolalloc as ta
from tests.builders import LINEAR_STAGE, says, telling
from tolalloc.reading.units import ARCMINUTE, MICROMETRE
from tolalloc.reducers import BACKLASH, LOST_MOTION, RADIAL_CLEARANCE
from tolalloc.reducers.contact import contact_of
from tolalloc.reducers.equivalent.hysteresis import TURN_ANGLES
from tolalloc.reducers.modification import ModificationRequest, choose
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reports.header import Header
from tolalloc.reports.portrait import portrait_of
from tolalloc.study.answer import Answer
from tolalloc.study.commands import check
from tolalloc.study.prepared import Prepared

Angles = np.ndarray
OUTPUT = "y [µm]"
ISO_OF_40_MM = {"H7": (25, 0), "h6": (0, -16), "k6": (18, 2), "js6": (8, -8), "g6": (-9, -25)}
"""Fit → its deviations at 40 mm by ISO 286-2 [µm]."""


def free_by_side(reducer: Reducer, side: int, angle: float) -> list[float]:
    """Return how far a carrier turns to one side until each disc is pressed, shaft or sun held, all parts rigid [rad].

    From the geometry alone: gap of a pin over its lever, and of an output pin over the way that it has in its hole.
    """
    stage, found = reducer.cycloid_stage, []
    ratio, eccentricity = stage.shortening, stage.eccentricity
    for disc in range(reducer.disc_count):
        crank = -stage.disc_teeth * angle + 2 * np.pi * disc / reducer.disc_count
        phi = 2 * np.pi * np.arange(stage.pin_count) / stage.pin_count - crank
        root = np.sqrt(1 + ratio**2 - 2 * ratio * np.cos(phi))
        own = reducer.modification
        gap = own.equidistant - own.shift * (1 - ratio * np.cos(phi)) / root
        turn = stage.disc_teeth  # the shaft is held: the disc turns about its centre
        if reducer.crank_count:  # the sun is held: cranks carry the centre around
            turn = stage.pin_count * reducer.ratio / (reducer.ratio - 1)
        way = side * eccentricity * turn * np.sin(phi) / root
        free = (gap[way > 1e-12] / way[way > 1e-12]).min()
        if not reducer.crank_count:
            holes = reducer.output_pins
            at = angle + 2 * np.pi * np.arange(holes.count) / holes.count
            room = holes.hole_radius - holes.pin_radius - eccentricity
            free += room / (holes.circle_radius * (-side * np.sin(crank - at)).max())
        found.append(float(free))
    return found


def free_rotation(reducer: Reducer) -> float:
    """Return the free rotation of the carrier between both sides, mean over the turn [arcmin]."""
    turned = [sum(min(free_by_side(reducer, side, angle)) for side in (1, -1)) for angle in TURN_ANGLES]
    return float(np.mean(turned)) / ARCMINUTE


def with_clearances(reducer: Reducer, flank: float, radial: float) -> Reducer:
    amounts = reducer.modification.from_clearances(flank * MICROMETRE, radial * MICROMETRE, reducer.cycloid_stage)
    return replace(reducer, modification=amounts)


def sentences(kind: str, found: Any) -> tuple[str, ...]:
    return tuple(Answer(kind=kind, header=Header(name=kind, model="own"), result=found).teller.sentences)


RIGID = load_reducer("rv20e_liu2020").stiffness
"""Printed stiffnesses, under which backlash yields by less than 0.01″."""


@pytest.mark.parametrize(
    ("name", "flank", "radial"),
    [
        (str(LINEAR_STAGE), 5.0, 10.0),
        (str(LINEAR_STAGE), 1.0, 5.0),
        ("cd29", 4.0, 10.0),
        ("bx40e", 3.0, 8.0),
        ("rv20e", 10.7, 15.0),
        ("rv80e", 3.5, 8.0),
    ],
)
def test_backlash_of_a_contact_is_that_of_the_whole_train(name, flank, radial):
    reducer = with_clearances(load_reducer(name), flank, radial)
    if reducer.crank_count:
        reducer = replace(reducer, parts=(), stiffness=RIGID)
    found = contact_of(reducer, -reducer.load.rated_torque, phases=1)
    expected = free_rotation(reducer)
    assert found.loop.backlash[0] / ARCMINUTE == pytest.approx(expected, abs=0.02)
    assert found.loop.lost_motion[0] > found.loop.backlash[0]
    said = telling(sentences("contact", found), "contact.clearance")
    assert f"{found.loop.backlash[0] / ARCMINUTE:.2f}′" in said


def test_two_numbers_by_hand():
    """2·5/29 and 2·5/24 µm/mm of teeth and holes, a little more as pins stand apart; RV: zc/zp·(1 − 1/i) of the disc's.

    The disc's 0.6205′ is 0.599′ at the output of an RV-20E: 39/40·104/105 of it.
    """
    stage = load_reducer(str(LINEAR_STAGE))
    by_hand = (2 * 4.989e-3 / 29 + 2 * 5e-3 / 24) / ARCMINUTE
    assert free_rotation(stage) == pytest.approx(by_hand, rel=0.03)
    rv = load_reducer("rv20e_liu2020")
    rv = with_clearances(rv, 0.6205 * ARCMINUTE / 2 * 35.1e3, 8.0)
    found = contact_of(rv, -167.0, phases=1)
    assert found.assessment.clearance.free_rotation / ARCMINUTE == pytest.approx(0.6205, abs=2e-3)
    assert found.loop.backlash[0] / ARCMINUTE == pytest.approx(0.6205 * 39 / 40 * 104 / 105, abs=0.004)


@pytest.mark.parametrize(("name", "flank", "radial"), [(str(LINEAR_STAGE), 1.0, 5.0), ("rv27c", 3.5, 8.0)])
def test_modify_contact_and_check_agree(name, flank, radial):
    request = ModificationRequest(flank_clearance=flank * MICROMETRE, radial_clearance=radial * MICROMETRE)
    found = choose(request, load_reducer(name), -load_reducer(name).load.rated_torque)
    table = "cd29_drawing" if "cd29" in name else "rv27c_drawing"
    model = Prepared(study=study_of(name, table)).model.at(np.array([flank, radial]))
    x = np.array([model.middles])
    values = model.reading((BACKLASH, LOST_MOTION))(x).values[0]
    loop = found.contact.loop
    assert values == pytest.approx([loop.backlash[0] / ARCMINUTE, loop.lost_motion[0] / ARCMINUTE], rel=2e-3)
    examined = portrait_of(model).examination(model.examined(np.repeat(x, 2, axis=0)))
    (said,) = (own for own in examined.sentences if "whole reducer" in own)
    assert f"{values[0]:.2f}′ of backlash and {values[1]:.2f}′ of lost motion" in said
    assert says(sentences("modification", found), "modification.backlash")


def study_of(name: str, drawing: Any, **changes: Any) -> ta.Study:
    ranges = {"flank_clearance": (1.0, 12.0), "radial_clearance": (5.0, 30.0)}
    fields = {"limits": {LOST_MOTION: ta.Limit(upper=9.0)}, "questions": [ta.Allocation()], **changes}
    return ta.Study(ta.reducer(name, **ranges), ta.drawing(drawing), name="mean", **fields)


def with_pins(folder: Path, table: str, plus: str, minus: str = "") -> Path:
    """Return a shipped table whose pins have another cell for their deviations."""
    text = (Path(ta.__file__).parent / "drawings" / "data" / f"{table}.tolerances.csv").read_text(encoding="utf-8")
    (row,) = (own for own in text.splitlines() if own.startswith("pin.diameter,"))
    cells = row.split(",")
    heads = next(own for own in text.splitlines() if own.startswith("id,")).split(",")
    for head, cell in (("plus [unit]", plus), ("minus [unit]", minus), ("min [unit]", "0.6"), ("max [unit]", "20")):
        cells[heads.index(head)] = cell
    path = folder / f"{table}.csv"
    path.write_text(text.replace(row, ",".join(cells)), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("name", "fit", "middle"),
    [
        ("rv80e", "h5", -3.0),
        ("rv80e", "js6", 0.0),
        ("rv80e", "k6", 5.5),
        ("rv20e", "h5", -2.5),
        ("rv20e", "g5", -6.5),
        ("rv27c", "h6", -4.0),
        ("cd29", "h6", -4.0),
    ],
)
def test_clearances_told_are_those_of_mean_pins(name, fit, middle, tmp_path):
    """ISO 286: 8 h5 0/−6, js6 ±4.5, k6 +10/+1; 4 h5 0/−5, g5 −4/−9; 4.5 and 5 h6 0/−8 µm.

    A pin thinner by 3 µm leaves 1.5 µm by its radius, and 1.5 µm more as it yields into its groove, on every side.
    """
    table = with_pins(tmp_path, f"{name}_drawing", fit)
    study = study_of(name, table)
    model = Prepared(study=study).model
    flank, radial = model.present_clearances
    x = np.array([model.middles])
    _, *mean = model.reducer_in_force.modification.clearances(model.reducer.cycloid_stage)
    assert np.array(mean) / MICROMETRE == pytest.approx([flank - middle, radial - middle], abs=1e-6)
    unit = model.reading((RADIAL_CLEARANCE,))(x).values[0, 0]
    assert unit == pytest.approx(radial - middle, abs=1e-6)
    examined = portrait_of(model).examination(model.examined(np.repeat(x, 2, axis=0)))
    (said,) = (own for own in examined.sentences if "whole reducer" in own)
    told = [float(own.replace("−", "-")) for own in re.findall(r"([−\d.]+) µm", said)]
    assert told == pytest.approx([flank - middle, radial - middle], abs=0.06)


def test_play_of_mean_parts_is_that_of_their_unit(tmp_path):
    """Pins of 3.9975 mm turn the carrier 2·2.5 µm over e·zp·i/(i − 1) further than pins of 4."""
    loops = [
        Prepared(study=study_of("rv20e_liu2020", with_pins(tmp_path, "rv20e_drawing", *cells))).model
        for cells in (("2.5", "-2.5"), ("h5", ""))
    ]
    plain, thin = (float(own.exact_loop_in_force.backlash[0]) for own in loops)
    assert thin - plain == pytest.approx(2 * 2.5e-6 / (0.9e-3 * 40 * 105 / 104), rel=0.05)


def parabola(s: float, a: float) -> float:
    return (s - 2.0) ** 2 + 1.0 + a


def line(s: float, a: float) -> float:
    return s + a


def stack(a: float) -> float:
    return a


def reached(sentences: tuple[str, ...]) -> list[float]:
    """Return what parts in the middle of their zones reach of every limit that they miss."""
    return [float(re.search(r"best value is (\S+)", own)[1]) for own in sentences]


def study_of_one(
    function: Callable[..., float], limit: ta.Limit, fit: str = "h6", settings: tuple[Any, ...] = ()
) -> ta.Study:
    """Return the study of one part, nominally 40 mm without a setting and 0 beside one."""
    nominal = 0.0 if settings else 40.0
    row = {"id": "a", "feature": "size", "nominal": nominal, "unit": "µm", "min": 0.1, "max": 50.0, "cost": 1.0}
    row |= {"plus": 1.0, "minus": -1.0} if settings else dict(zip(("plus", "minus"), ISO_OF_40_MM[fit], strict=True))
    model = ta.model(function, inputs={"a": nominal}, outputs=(OUTPUT,), settings=settings)
    drawing = ta.Drawing.of_rows([row])
    return ta.Study(model, drawing, limits={OUTPUT: limit}, questions=[ta.Allocation()], name="m", effort="quick")


@pytest.mark.parametrize(
    ("function", "limit", "best"),
    [
        (line, ta.Limit(upper=0.5), 1.0),
        (line, ta.Limit(lower=3.5), 3.0),
        (line, ta.Limit(upper=1.5), None),
        (parabola, ta.Limit(upper=0.9), 1.0),
        (parabola, ta.Limit(upper=1.1), None),
        (parabola, ta.Limit(lower=3), 2.0),
    ],
)
def test_limits_that_no_setting_keeps_are_named_with_the_best(function, limit, best):
    setting = ta.Setting(name="s", value=2.5, lower=1.0, upper=3.0, step=0.1)
    answer = check(study_of_one(function, limit, settings=(setting,)))
    assert reached(answer.result.missed) == ([] if best is None else [pytest.approx(best)])
    assert says(answer.teller.sentences, "check.missed") == (best is not None)
    assert ("is in order" in answer.teller.title) == (best is None)


@pytest.mark.parametrize(
    ("fit", "limit", "best"),
    [("H7", 40.01, None), ("h6", 40.0, 39.992), ("k6", 40.005, None), ("js6", 40.005, 40.0), ("g6", 39.99, 39.983)],
)
def test_the_middle_of_a_fit_counts_and_not_its_nominal_size(fit, limit, best):
    """At least 40.01 mm is kept by H7 of 40 mm, whose middle is 40.0125, and 40 mm not by h6."""
    answer = check(study_of_one(stack, ta.Limit(lower=limit), fit))
    assert reached(answer.result.missed) == ([] if best is None else [pytest.approx(best, abs=0.005)])


class Told:
    """What a progress was told, with nothing shown."""

    def __init__(self) -> None:
        self.sentences: list[str] = []

    def begin(self, stage: str, units: int = 0, counted: str = "") -> None: ...

    def advance(self, units: int = 1) -> None: ...

    def tell(self, sentence: str) -> None:
        self.sentences.append(sentence)


@pytest.mark.slow
def test_an_allocation_says_first_that_a_limit_is_out_of_reach(tmp_path):
    told = Told()
    study = study_of_one(stack, ta.Limit(lower=40.0), "h6")
    found = study.run(tmp_path / "out", progress=told)
    assert says(told.sentences[:1], "check.missed")
    assert says(found.document.warnings, "check.missed")


@pytest.mark.slow
def test_a_single_stage_names_the_lost_motion_that_it_can_reach():
    """The best is the least room on the flank, 1 of 1 to 12 µm, and 5 of 5 to 30 µm at tip and root: 1.88′."""
    study = study_of(str(LINEAR_STAGE), "cd29_drawing", limits={LOST_MOTION: ta.Limit(upper=1.5)})
    (found,) = Prepared(study=study).missed
    assert "flank clearance [µm] = 1, radial clearance [µm] = 5" in found
    assert reached((found,)) == [pytest.approx(1.88, abs=0.01)]
    reachable = replace(study, limits={LOST_MOTION: ta.Limit(upper=1.95)})
    assert Prepared(study=reachable).missed == ()

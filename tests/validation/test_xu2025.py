"""Three units of xu2025 by precision class: rigidity falls and lost motion rises as bearings get looser.

Printed are the torsional rigidity 131.98, 125.55, 117.41 N·m/arcmin, the lost motion 0.364, 0.389, 0.412′, and of
single changes that the support bearings move the rigidity most and the clearance of the crank bearings the lost motion.
Neither clearances nor preload are printed here, nor the size. Assumed are the RV-40E, whose rigidity is nearest, its
perfect parts, the crankshaft's tapered bearings in the carrier as support bearings, those in the discs as crank
bearings, and the classes: support bearings under a preload of 1000 N, 500 N and none, crank bearings with a clearance
of 0, 0.25 and 0.5 µm.
"""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

from tests.validation_manual import shown
from tolalloc.reading.files import validated
from tolalloc.reading.units import ARCMINUTE, DEGREE
from tolalloc.reducers.equivalent.hysteresis import hysteresis_loop
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.reducer.files import PRESETS, load_reducer
from tolalloc.reducers.reducer.records import ReducerRecord

RIGIDITY, LOST_MOTION = (131.98, 125.55, 117.41), (0.364, 0.389, 0.412)  # N·m/arcmin, arcmin
ANGLES = 3 * DEGREE * np.arange(3)
"""Three phases of a pin pitch, which is all that perfect parts have [rad]."""
PRELOADS, CLEARANCES = (1000.0, 500.0, 0.0), (0.0, 0.25, 0.5)  # N, µm


def measured(**bearings: dict[str, float]) -> np.ndarray:
    """Return rigidity [N·m/arcmin] and lost motion [arcmin] of the perfect RV-40E with changes of its bearings."""
    path = PRESETS / "rv40e.reducer.toml"
    table = tomllib.loads(path.read_text(encoding="utf-8"))
    for name, changed in bearings.items():
        table["stiffness"][name] |= changed
    model = EquivalentModel(validated(ReducerRecord, table, path).reducer())
    loop = hysteresis_loop(model, np.zeros((1, len(model.columns))), ANGLES)
    return np.array([loop.torsional_stiffness[0] * ARCMINUTE, loop.lost_motion[0] / ARCMINUTE])


def support(preload: float) -> dict[str, dict[str, float]]:
    return {"crank_carrier_bearing": {"preload_n": preload}}


def crank(clearance: float) -> dict[str, dict[str, float]]:
    return {"crank_disc_bearing": {"clearance_um": clearance}}


@pytest.fixture(scope="module")
def plain() -> np.ndarray:
    """Neither preload nor clearance."""
    return measured()


def test_no_preset_is_nearer_in_rigidity():
    sizes = ("rv20e", "rv40e", "rv80e", "rv110e", "rv160e")
    off = {size: load_reducer(size).catalogue.torsional_rigidity * ARCMINUTE / np.mean(RIGIDITY) for size in sizes}
    assert min(off, key=lambda size: abs(np.log(off[size]))) == "rv40e"


def test_both_trends_have_the_printed_sign_and_order_of_size():
    """Rigidity −4.0 and −8.4 % (−4.9, −11.0), lost motion +15 and +45 % (+6.9, +13.2)."""
    classes = [
        measured(**support(preload), **crank(clearance))
        for preload, clearance in zip(PRELOADS, CLEARANCES, strict=True)
    ]
    rigidity, lost = np.array(classes).T
    assert (np.diff(rigidity) < 0).all()
    assert (np.diff(lost) > 0).all()
    found = np.array([rigidity[1:] / rigidity[0] - 1, lost[1:] / lost[0] - 1])
    printed = [[125.55 / 131.98 - 1, 117.41 / 131.98 - 1], [0.389 / 0.364 - 1, 0.412 / 0.364 - 1]]
    shown("V8", 100 * float(found[0, 1]))
    assert (found / printed > 1 / 4).all()
    assert (found / printed < 4).all()


def test_support_bearings_move_the_rigidity_most_if_they_lose_preload(plain):
    """Losing 1000 N costs 8 %; 0.5 µm in the crank bearings costs less than 0.1 %."""
    by_support, by_crank = measured(**support(1000.0))[0] / plain[0] - 1, 1 - measured(**crank(0.5))[0] / plain[0]
    assert by_support == pytest.approx(0.091, abs=0.01)
    assert 0 < by_crank < 0.001


def test_support_bearings_do_not_move_the_rigidity_most_if_they_only_get_clearance(plain):
    """Not as the source has it: 4 µm in either bearing costs less than 1 %, in the crank bearings a little more."""
    loose = {"clearance_um": 4.0}
    fall = [1 - measured(**{f"crank_{name}_bearing": loose})[0] / plain[0] for name in ("carrier", "disc")]
    assert 0.006 < fall[0] < fall[1] < 0.01


def test_clearance_of_the_crank_bearings_moves_the_lost_motion_most(plain):
    """By 0.14′ a micrometre, that of the support bearings by 0.13′; losing 1000 N of preload adds 0.04′ in all."""
    loose = {"clearance_um": 1.0}
    by_support, by_crank = (measured(**{f"crank_{name}_bearing": loose})[1] - plain[1] for name in ("carrier", "disc"))
    assert by_crank == pytest.approx(0.140, abs=0.003)
    assert by_support == pytest.approx(0.130, abs=0.003)
    assert plain[1] - measured(**support(1000.0))[1] == pytest.approx(0.044, abs=0.003)


def test_one_micrometre_moves_the_lost_motion_more_than_the_three_classes_do(plain):
    """So clearances of operation differ by tenths of a micrometre between the classes, or preload hides them."""
    assert measured(**crank(1.0))[1] - plain[1] > 2 * (LOST_MOTION[2] - LOST_MOTION[0])
    assert measured(carrier_bearing={"clearance_um": 10.0}) == pytest.approx(plain, rel=1e-6)

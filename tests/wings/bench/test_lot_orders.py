"""Orders of a lot's curves: false alarms, a housing that moved, sources of an order, waves, what is refused."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

import tolalloc as ta
from tolalloc.capability.indices import holm
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError
from tolalloc.models.model import Evaluation
from tolalloc.wings.bench.lot_orders import (
    LotCurves,
    PredictedOrder,
    judged_orders,
    left_out_of,
    load_lot_curves,
    predicted_orders,
    with_sources,
)
from tolalloc.wings.bench.posterior import Noise

LEVEL, UNITS, LOTS = 0.05, 25, 200
NOISE = 0.03
"""Standard deviation of cosine and sine of a curve of 720 readings that err by 0.5″ [arcsec]."""


def curves_at(torque: float | None) -> LotCurves:
    drawing = ta.drawing("rv20e_drawing")
    model = ta.reducer("rv20e", torque=torque).set_to(drawing.settings).bound(drawing.errors, "lot")
    return LotCurves(
        model=model,
        errors=drawing.errors,
        orders=tuple(model.spectra),
        waves=np.zeros((UNITS, len(model.spectra)), complex),
        noise=np.full(UNITS, NOISE),
        discrepancy=Noise(),
    )


def alarms(curves: LotCurves, x: np.ndarray, rng: np.random.Generator) -> int:
    """Return how many lots of these units have an order named, read with noise and what the model leaves out."""
    predicted = predicted_orders(curves, 2**14, 1)

    def normal(*shape: int) -> np.ndarray:
        return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)

    made = curves.made(x).reshape(LOTS, UNITS, -1)
    apart = [left_out_of(order, curves.discrepancy) for order in curves.orders]
    read = made + NOISE * normal(*made.shape) + apart * normal(LOTS, 1, len(apart))
    found = [judged_orders(replace(curves, waves=waves), predicted) for waves in read]
    return sum(holm([own.probability for own in one], LEVEL).any() for one in found)


@pytest.mark.slow
def test_unmoved_lots_raise_no_more_alarms_and_a_housing_of_twice_the_second_wave_is_found():
    rng = np.random.default_rng(5)
    curves = curves_at(None)  # at 1 N·m all orders are far above what the bench adds
    count = alarms(curves, curves.errors.random_units(LOTS * UNITS, SeedTree(31)), rng)
    # Beyond this count a rate of 5 % is refuted with 99.9 % confidence; far below 10 of 200 the tests would be blunt.
    assert 1 <= count <= stats.binom.isf(0.001, LOTS, LEVEL), count
    curves = curves_at(-167.0)
    x = curves.errors.random_units(LOTS * UNITS, SeedTree(32))
    x[:, [curves.errors.columns.index(f"housing.pitch.{wave}2") for wave in ("cos", "sin")]] *= 2.0
    count = alarms(curves, x, rng)
    assert count >= 0.95 * LOTS, count


def standing_in() -> LotCurves:
    """Return curves of a linear model: two places make order 2, variances 4 to 1, the second alone order 5."""
    row = {"plus": 8, "minus": 0, "unit": "µm", "min": 1, "max": 60, "cost": 1.0, "feature": "position"}
    errors = ta.Drawing.of_rows([{"id": "a", **row}, {"id": "b", **row}]).errors

    def response(x: np.ndarray) -> Evaluation:
        a, b = np.hsplit(x / 1e-6, 2)
        return Evaluation(values=np.hstack([2.0 * a + b, b]), status=np.zeros(len(x), np.uint8))

    spectra = {2: ("c2", "s2"), 5: ("c5", "s5")}
    model = SimpleNamespace(
        spectra=spectra,
        reading=lambda outputs: response,
        kernel=SimpleNamespace(torque=-10.0),
        reducer=SimpleNamespace(resolves=lambda order, angles: (order, angles) != (5, 96)),
    )
    waves, noise = np.zeros((UNITS, 2), complex), np.full(UNITS, NOISE)
    return LotCurves(model=model, errors=errors, orders=(2, 5), waves=waves, noise=noise, discrepancy=Noise())


def test_with_sources_tells_the_sources_of_a_moved_order_alone():
    curves = standing_in()
    wide = curves.made(1.6 * curves.errors.random_units(UNITS, SeedTree(3)))
    orders = judged_orders(replace(curves, waves=wide), predicted_orders(curves, 2**14, 1))
    # The mean square of 25 such waves is that of 50 normal numbers.
    for own, variance in zip(orders, (5.0, 1.0), strict=True):
        sigma = variance * (8.0 * curves.errors.sources[0].zone_mapping.wave_deviation) ** 2  # of a coordinate [µm²]
        assert own.predicted == pytest.approx(np.sqrt(stats.chi2.ppf([0.05, 0.95], 50) * sigma / UNITS), rel=0.03)
    second, fifth = with_sources(curves, orders, [True, False], 1)
    assert second.moved and not fifth.moved
    assert [name for name, _ in second.sources] == ["a", "b"]
    assert [share for _, share in second.sources] == pytest.approx([0.8, 0.2], abs=0.15)
    assert not fifth.sources
    assert with_sources(curves, orders, [False, False], 1) == orders


def test_judged_takes_noise_as_a_bound():
    """A lot is too small only against lots without noise, too large only against lots with it."""
    own = PredictedOrder(order=1, exact=np.linspace(1.0, 2.0, 999), read=np.linspace(3.0, 4.0, 999))
    assert [own.judged(np.full(5, np.sqrt(square))).probability for square in (0.5, 2.5, 4.5)] == [0.002, 1.0, 0.002]


def write_curves(folder, readings=90, span=360.0, torque=None):
    """Write five curves of order 2, 3″ cosine and 4″ sine, one of which starts elsewhere."""
    folder.mkdir()
    heads = "angle [deg],transmission error [arcsec]" + ("" if torque is None else ",torque [N·m]")
    more = "" if torque is None else f",{torque}"
    for unit in range(5):
        angle = np.linspace(0.0, span, readings, endpoint=False) + 7.0 * (unit == 4)
        turn = np.radians(2.0 * angle)
        rows = zip(angle, 3.0 * np.cos(turn) + 4.0 * np.sin(turn), strict=True)
        text = "".join(f"{one:.6f},{value:.6f}{more}\n" for one, value in rows)
        (folder / f"unit{unit}.csv").write_text(f"{heads}\n{text}", encoding="utf-8")
    return folder


def test_load_lot_curves_reads_waves_and_the_noise_of_their_readings(tmp_path):
    stand = standing_in()
    curves = load_lot_curves(write_curves(tmp_path / "curves"), stand.model, stand.errors, Noise())
    assert np.abs(curves.waves) == pytest.approx(np.array([[5.0, 0.0]] * 5), abs=1e-5)
    assert curves.waves[0, 0] == pytest.approx(3.0 - 4.0j, abs=1e-5)
    assert curves.noise == pytest.approx(0.5 * np.sqrt(2.0 / 90))


def test_orders_that_the_readings_do_not_hold_are_not_told(tmp_path):
    stand = standing_in()
    curves = load_lot_curves(write_curves(tmp_path / "curves", readings=96), stand.model, stand.errors, Noise())
    assert curves.orders == (2,)
    assert curves.waves.shape == (5, 1)
    assert curves.made(np.ones((1, 2))).shape == (1, 1)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"readings": 14}, "the number of readings is 14; allowed is 15 or more, 3 for each wave of order 5"),
        ({"span": 180.0}, "its angles is '182 deg'; allowed is up to 72 deg, a wave of order 5, all round the turn"),
        ({"torque": -5}, "the mean of 'torque [N·m]' is -5.0; allowed is -10 within 5%, the torque of the prediction"),
    ],
)
def test_curves_that_are_not_allowed_are_refused(tmp_path, given, sentence):
    stand = standing_in()
    with pytest.raises(InputError, match=r"unit0\.csv") as refused:
        load_lot_curves(write_curves(tmp_path / "curves", **given), stand.model, stand.errors, Noise())
    assert sentence in str(refused.value)
    with pytest.raises(InputError, match="the number of curves is 0; allowed is a folder of 5 to 200 CSV files"):
        load_lot_curves(tmp_path, stand.model, stand.errors, Noise())

"""Waves of pitch and run-out that all parts share: a mean of the columns beside what is random inside the zone."""

from __future__ import annotations

from math import radians
from pathlib import Path

import numpy as np
import pytest

import tolalloc as ta
from tests.builders import seeded_units, with_ovality, written
from tolalloc.cli.start import new
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.sources import limited_measure
from tolalloc.exceptions import InputError

HEADER = "id,feature,plus [unit],minus [unit],unit,min [unit],max [unit],cost [cost units],spectrum [order:amplitude],"
HEADER += "systematic [order:amplitude@°]"


def table(folder: Path, systematic: str, row: str = "ring.runout,runout,8,0,µm,2,20,1,1:7.2 2:2.7") -> Path:
    return written(folder / "zones.csv", f"{HEADER}\n{row},{systematic}\n")


def test_mean_of_the_columns_is_the_systematic_wave(tmp_path):
    (source,) = ta.drawing(table(tmp_path, "2:5.0@30")).errors.sources
    np.testing.assert_allclose(
        source.middles, [0.0, 0.0, 5e-6 * np.cos(radians(60)), 5e-6 * np.sin(radians(60))], atol=1e-18
    )
    turn = np.linspace(0.0, 2 * np.pi, 3601)
    wave = source.middles[2] * np.cos(2 * turn) + source.middles[3] * np.sin(2 * turn)
    assert wave.max() == pytest.approx(5e-6)
    assert np.degrees(turn[wave.argmax()]) % 180 == pytest.approx(30, abs=0.1)


def test_every_unit_has_the_wave_beside_its_random_ones(tmp_path):
    plain, shared = (ta.drawing(table(tmp_path, text)).errors for text in ("", "2:5.0@30 1:1.5@-90"))
    standard = plain.standard_values(next(iter(SeedTree(1).uniform_chunks(50, len(plain.columns)))))
    moved = shared.deviations(standard, shared.zones) - plain.deviations(standard, plain.zones)
    np.testing.assert_allclose(moved, np.tile(shared.sources[0].middles, (50, 1)), atol=1e-18)
    # The zone limits what is random: a gauge that knows the wave reads the same of both.
    read = [limited_measure(own.sources[0], own.deviations(standard, own.zones)) for own in (plain, shared)]
    np.testing.assert_allclose(read[1], read[0], rtol=1e-9)


def test_wave_does_not_shrink_with_its_zone(tmp_path):
    errors = ta.drawing(table(tmp_path, "2:5.0@30")).errors
    nothing = np.zeros((1, len(errors.columns)))
    np.testing.assert_array_equal(
        errors.deviations(nothing, errors.zones / 4), errors.deviations(nothing, errors.zones)
    )


def test_wave_without_a_random_part_is_fixed(tmp_path):
    row = "ring.runout,runout,0,0,µm,0,0,0,1:7.2 2:2.7"
    errors = ta.drawing(table(tmp_path, "2:2.0@0", row)).errors
    assert errors.columns == ()
    assert errors.fixed["ring.runout.cos2"] == pytest.approx(2e-6)
    assert errors.fixed["ring.runout.sin2"] == errors.fixed["ring.runout.cos1"] == 0.0


def test_written_table_has_the_wave(tmp_path):
    drawing = ta.drawing(table(tmp_path, "2:5.25@30 1:0.5@-45"))
    path = tmp_path / "written.csv"
    drawing.to_csv(path)
    found, expected = ta.drawing(path).errors.sources[0].systematic, drawing.errors.sources[0].systematic
    np.testing.assert_allclose(found, expected, rtol=1e-9)


@pytest.mark.parametrize("text", ["3:5.0@30", "2:5.0", "2:5.0@30 2:1.0@0", "2:-5.0@30", "2:5000@0", "oval"])
def test_waves_that_cannot_be_meant_are_refused(tmp_path, text):
    with pytest.raises(InputError, match="systematic"):
        _ = ta.drawing(table(tmp_path, text)).errors


def test_a_size_has_no_wave(tmp_path):
    with pytest.raises(InputError, match="systematic"):
        _ = ta.drawing(table(tmp_path, "2:5.0@30", "a,size,4,-4,µm,1,20,1,")).errors


def test_a_model_gets_the_wave_of_a_clamped_ring(tmp_path):
    drawing = ta.drawing("rv20e_drawing")
    new(tmp_path / "own", cranks=3)
    three = ta.reducer(tmp_path / "own" / "reducer.toml"), ta.drawing(tmp_path / "own" / "zones.xlsx")
    for reducer, plain in ((ta.reducer("rv20e", neglected=("disc*.tilt",)), drawing), three):
        at = []
        for amplitude in (0.0, 2e-6):
            own = with_ovality(plain, amplitude)
            model = reducer.bound(own.errors, "test")
            x = own.errors.deviations(np.zeros((1, len(own.errors.columns))), own.errors.zones)
            at.append(model.kernel.errors(x)[0, model.kernel.model.columns.index("housing.runout.cos2")])
        assert at[1] - at[0] == pytest.approx(2e-6)


@pytest.mark.slow
def test_ovality_of_the_ring_adds_to_the_peak_to_peak():
    """A ring that is oval by 2 µm in all units: about 7″ in the median, by a drawing that can be built."""
    medians = []
    for amplitude in (0.0, 2e-6):
        drawing = with_ovality(ta.drawing("rv20e_drawing"), amplitude)
        errors = drawing.errors
        model = ta.reducer("rv20e", neglected=("disc*.tilt",)).set_to(drawing.settings).bound(errors, "test")
        found = model.reading((ta.PEAK_TO_PEAK,))(seeded_units(errors, 200))
        medians.append(float(np.median(found.values[:, 0])))
    assert 4.0 < medians[1] - medians[0] < 11.0

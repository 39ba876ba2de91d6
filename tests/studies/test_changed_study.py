"""A study at another drawing and other settings: the model that a search tries, to the last bit."""

from __future__ import annotations

import numpy as np
import pytest

import tolalloc as ta
from tests.builders import prepared
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.tolerance_table import with_zones
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.study.prepared import Prepared

FLANK, RADIAL = "flank clearance [µm]", "radial clearance [µm]"


def test_a_changed_study_is_the_model_at_other_settings_and_zones_to_the_last_bit(tmp_path):
    before = prepared()
    zones = [0.7 * own.zone for own in before.errors.active]
    drawing = before.study.drawing.with_sources(with_zones(before.errors.active, zones))
    drawing.to_csv(tmp_path / "tighter.csv")
    after = Prepared(study=before.study.changed(tmp_path / "tighter.csv", {FLANK: 2.5, RADIAL: 9.25}, name="tighter"))
    assert after.study.name == "tighter"
    uniform = next(SeedTree(3).uniform_chunks(32, len(before.errors.columns)))
    x = before.errors.deviations(before.errors.standard_values(uniform), np.array(zones))
    same = after.errors.deviations(after.errors.standard_values(uniform), after.errors.zones)
    np.testing.assert_allclose(same, x, rtol=1e-14)  # a table says its zones in µm
    outputs = (ta.PEAK_TO_PEAK, ta.PRELOAD)
    found = after.model.reading(outputs)(x).values
    np.testing.assert_array_equal(found, before.model.at(np.array([2.5, 9.25])).reading(outputs)(x).values)


def test_settings_of_an_own_model_are_set_by_name():
    def preload(size, spring):
        return spring * size

    setting = ta.Setting(name="spring [N/mm]", value=50.0, lower=20.0, upper=90.0, step=0.5)
    model = ta.model(preload, inputs=("size",), outputs=("preload [N]",), settings=(setting,))
    assert model.set_to({"spring [N/mm]": 30.0}).settings[0].value == 30.0
    with pytest.raises(InputError, match="20 to 90, the bounds"):
        model.set_to({"spring [N/mm]": 91.0})


@pytest.mark.parametrize(
    ("settings", "error", "said"),
    [
        ({"flank clearence [µm]": 2.0}, UnknownNameError, FLANK),
        ({FLANK: 9.0}, InputError, "1 to 5"),
        ({FLANK: "2"}, InputError, "1 to 5"),
    ],
)
def test_a_setting_that_is_not_there_or_out_of_bounds_is_a_sentence(settings, error, said):
    study = prepared().study
    with pytest.raises(error) as raised:
        study.changed(study.drawing, settings)
    assert said in str(raised.value)

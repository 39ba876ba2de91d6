"""Letters that matplotlib's own font has not: drawn by an installed one that has them, or said once."""

from __future__ import annotations

import io
import warnings

import pytest
from matplotlib.text import Text

from tolalloc.reports import fonts
from tolalloc.reports.figure import HeatMap
from tolalloc.reports.plots import drawn

SCRIPT = "ℊ"
"""Is in the font for formulas that comes with matplotlib, not in the one that it writes with."""


def map_of(name: str) -> HeatMap:
    return HeatMap(name="map", title=name, columns=["a"], rows=[name], label="share [-]", values=[[1.0]])


@pytest.mark.filterwarnings("error")
def test_a_second_font_draws_what_the_usual_one_lacks():
    canvas = drawn(map_of(f"pin {SCRIPT}"))
    canvas.savefig(io.BytesIO(), format="png")
    second = fonts.font_with(frozenset(SCRIPT))
    assert second is not None
    assert second.name in canvas.findobj(Text)[0].get_fontfamily()


def test_letters_that_no_font_has_are_said_once_and_no_raw_warning_follows(monkeypatch, capsys):
    monkeypatch.setattr(fonts, "font_with", lambda letters: None)
    fonts._say_once.cache_clear()
    with warnings.catch_warnings(record=True) as raw:
        warnings.simplefilter("always")
        for _ in range(2):
            drawn(map_of(f"bolt {SCRIPT}")).savefig(io.BytesIO(), format="png")
    assert capsys.readouterr().err == f"No installed font has the letters {SCRIPT}: pictures show boxes instead.\n"
    assert not raw


def test_usual_letters_keep_the_usual_font():
    canvas = drawn(map_of("Bolzen ⌀ Maß é µ ″"))
    assert len(canvas.findobj(Text)[0].get_fontfamily()) == 1


def test_a_file_that_is_no_font_has_no_letters(tmp_path):
    broken = tmp_path / "broken.ttf"
    broken.write_bytes(b"no font")
    assert fonts._letters_of(str(broken)) == frozenset()

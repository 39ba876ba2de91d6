"""What a reader of a report relies on: histograms that can be compared, and a drawing that is never folded."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from tests.builders import page_of
from tolalloc.reports.document import Document, Section
from tolalloc.reports.figure import Figure, HeatMap, Series, chart
from tolalloc.reports.plots import drawn
from tolalloc.reports.writer import write_document


def test_histograms_of_samples_of_any_size_are_shares_in_the_same_bins():
    few, many = np.linspace(10, 50, 100), np.linspace(20, 70, 5000)
    figure = Figure(
        name="units",
        title="Units",
        x_label="peak-to-peak transmission error [arcsec]",
        y_label="share of the units [%]",
        series=tuple(
            Series(label=label, kind="histogram", x=list(x)) for label, x in (("before", few), ("after", many))
        ),
    )
    before, after = drawn(figure).axes[0].containers
    for bars in (before, after):
        assert sum(bar.get_height() for bar in bars) == pytest.approx(100.0)
    assert [bar.get_x() for bar in before] == [bar.get_x() for bar in after]
    for own, bars in zip(chart(figure)["series"], (before, after), strict=True):
        assert own["y"] == pytest.approx([bar.get_height() for bar in bars], rel=1e-5)
        assert own["x"] == pytest.approx([bar.get_x() for bar in bars], rel=1e-5)


@pytest.mark.parametrize("unfolded", [True, False])
def test_a_long_table_is_folded_unless_it_is_the_drawing(tmp_path, unfolded):
    table = pd.DataFrame({"source": [f"source {number}" for number in range(40)]})
    section = Section(heading="What to write on the drawing", tables=(("drawing", table),), unfolded=unfolded)
    document = Document(
        title="Drawing",
        subtitle="",
        answer=(),
        warnings=(),
        sections=(section,),
        assumptions=(),
        summary={},
        seed=1,
    )
    write_document(document, tmp_path / "report")
    page = page_of(tmp_path / "report")
    assert ("<details><summary>drawing, 40 rows" in page) is not unfolded
    assert "source 39" in page


def _report(folder, rows=60):
    """Write a report with a wide and a long table and a chart of each kind."""
    many = pd.DataFrame({f"quantity {column} [µm]": np.arange(rows) + column / 7 for column in range(14)})
    many.insert(0, "source", [f"crank{row}.journal.eccentricity" for row in range(rows)])
    bars = Series(label="share", kind="bars", x=["a.b", "c.d"], y=[0.6, 0.2], low=[0.5, 0.1], high=[0.8, 0.4])
    line = Series(
        label="unit </script> 1", kind="line", x=list(np.linspace(0, 360, 200)), y=[float("nan"), *range(199)]
    )
    heat = HeatMap(name="h", title="Heat", columns=["78"], rows=["a"], x_label="order", label="share", values=[[0.5]])
    section = Section(
        heading="What to write on the drawing",
        figures=(
            Figure(name="b", title="Bars", x_label="share [-]", series=(bars,)),
            Figure(name="l", title="Line", x_label="angle [°]", series=(line,)),
            heat,
        ),
        tables=(("drawing", many),),
        unfolded=True,
    )
    document = Document(
        title="A drawing", subtitle="", answer=("Met.",), warnings=(), sections=(section,), assumptions=(), summary={}
    )
    write_document(document, folder)
    return folder / "report.html"


def test_a_rounded_number_says_itself_whole_and_no_text_ends_a_script(tmp_path):
    page = _report(tmp_path / "report", rows=3).read_text(encoding="utf-8")
    assert '<td class="number" title="0.1428571429">0.1429</td>' in page
    assert '<td class="number">2</td>' in page  # whole as it stands
    assert page.count("</script>") == page.count("<script") == 4
    assert "\\u003c/script>" in page
    assert len(page) < 100_000

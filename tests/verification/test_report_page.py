"""What a reader of a report relies on: histograms that can be compared, and a drawing that is never folded."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from tolalloc.report.document import Document, Section
from tolalloc.report.figure import Figure, Series
from tolalloc.report.plots import as_html, drawn
from tolalloc.report.writer import write_document


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
    page = as_html(figure)
    assert page.count('"histnorm":"percent"') == 2
    assert page.count('"start":10.0') == 2


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
    page = (tmp_path / "report" / "report.html").read_text(encoding="utf-8")
    assert ("<details><summary>drawing, 40 rows" in page) is not unfolded
    assert "source 39" in page

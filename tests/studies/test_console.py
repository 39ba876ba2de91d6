"""Tables on a narrow terminal: no number is cut."""

from __future__ import annotations

import pandas as pd
import pytest

from tolalloc.cli.console import print_table


@pytest.mark.parametrize("width", ["40", "80", "200"])
def test_no_number_is_cut_however_narrow_the_screen(capsys, monkeypatch, width):
    monkeypatch.setenv("COLUMNS", width)
    names = [f"expected loss of the unit, kind {kind} [arcsec]" for kind in "abcdef"]
    numbers = [[1234.5 + 0.1 * row + column for column in range(len(names))] for row in range(3)]
    label = "a quantity with a name that is much longer than what a terminal of eighty columns has room for [arcsec]"
    frame = pd.DataFrame(numbers, columns=names)
    frame.insert(0, "quantity", [label, "b", "c"])
    frame[""] = ""
    print_table(frame, "wide")
    said = capsys.readouterr().out
    assert all(
        len(line) <= int(width) and (line.rstrip()[-1] in "┓┃┩│┘" or "wide" in line) for line in said.splitlines()
    )
    for row in numbers:
        for number in row:
            assert f"{number:.4g}" in said
    assert "…" not in said
    assert all(word in said for word in label.split())

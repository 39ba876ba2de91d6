"""The notebook of the documentation, cell by cell as a person runs it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.builders import says

NOTEBOOK = Path(__file__).parents[2] / "docs" / "first-look.ipynb"


@pytest.mark.slow
def test_every_cell_runs_and_every_answer_shows_itself(tmp_path, monkeypatch):
    shells = pytest.importorskip("IPython.core.interactiveshell")
    monkeypatch.chdir(tmp_path)
    shell = shells.InteractiveShell()
    cells = [cell for cell in json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"] if cell["cell_type"] == "code"]
    shown = []
    for cell in cells:
        found = shell.run_cell("".join(cell["source"]))
        found.raise_error()
        formats, _ = shell.display_formatter.format(found.result)
        shown.append(formats.get("text/html", "").replace("<wbr>", ""))
    drawing, ranking, found = shown[0], shown[3], shown[4]
    assert "carrier.assembly" in drawing
    assert "total index ST [-]" in ranking
    assert "<table" in found and "data:image/png;base64" in found and says(found, "allocation.met")
    assert (tmp_path / "first_look" / "report.html").is_file()
    assert (tmp_path / "new.csv").is_file()

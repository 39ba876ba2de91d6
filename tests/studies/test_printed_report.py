"""A report on screen and on paper: its structure, and that a printed one has lost nothing."""

from __future__ import annotations

import subprocess
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pandas as pd
import pytest

import tolalloc as ta
from tests.builders import page_of
from tests.studies.command import refused, tolalloc
from tests.studies.paper import MISSING, can_print, lost
from tolalloc.exceptions import InputError
from tolalloc.reports import pdf
from tolalloc.reports.document import Document, Section, joined
from tolalloc.reports.feature_frame import FeatureFrame
from tolalloc.reports.figure import Figure, HeatMap, Series
from tolalloc.reports.writer import html_table, write_document

TITLE = "A title that is far longer than its picture is wide, as it has to say what an empty cell of it means"
LIMITS = {ta.PEAK_TO_PEAK: ta.Limit(upper=60.0)}
VOID = {"meta", "br", "wbr", "img", "link", "hr"}


class Page(HTMLParser):
    """What stands in a page: open and closed tags, names, links, tables with their cells, texts of pictures."""

    def __init__(self, text: str):
        super().__init__()
        self.open, self.faults, self.names, self.links = [], [], [], []
        self.tables, self.pictures, self.headings = [], 0, []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        known = dict(attrs)
        self.names += [known["id"]] if "id" in known else []
        self.links += [known["href"]] if tag == "a" else []
        self.pictures += tag == "svg"
        if tag == "table":
            self.tables.append([])
        elif tag == "tr":
            self.tables[-1].append(0)
        elif tag in ("td", "th"):
            self.tables[-1][-1] += 1
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.names += [own for name, own in attrs if name == "id"]

    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag:
            self.faults.append(tag)

    def handle_data(self, data):
        if self.open and self.open[-1] in ("h1", "h2", "h3"):
            self.headings.append(data)


def report(title: str, *, first: bool = False, rows: int = 60) -> Document:
    numbers = np.arange(rows, dtype=float)
    long = pd.DataFrame(
        {"source": [f"{title}.part{at}.position" for at in range(rows)], "zone [µm]": numbers + 0.123456}
    )
    wide = pd.DataFrame({f"a long header of column {at} [arcsec]": numbers[:3] * 1234.5678 for at in range(15)})
    framed = pd.DataFrame(
        {"dimension": ["bores"], "write [mm]": [FeatureFrame("position", "⌀0.0047", ("A",), "4.75 µm")]}
    )
    bars = Series(label="index", kind="bars", x=[f"s{at}" for at in range(24)], y=list(numbers[:24]))
    cells = HeatMap(
        name=f"{title} cells", title=TITLE, columns=["1", "2"], rows=["a"], label="[-]", values=[[1.0, 0.2]]
    )
    return Document(
        title=title,
        subtitle="seed 1",
        answer=tuple(f"{title}: sentence {at} on the yield." for at in range(6)),
        warnings=(f"{title} is quick.",),
        sections=(
            Section(heading="What to write", tables=((f"{title} drawing", framed),), first=first, unfolded=True),
            Section(heading="Long", tables=((f"{title} long", long),), unfolded=True),
            Section(heading="Wide", tables=((f"{title} wide", wide),)),
            Section(
                heading="Pictures", figures=(Figure(name=title, title="Bars", x_label="[-]", series=(bars,)), cells)
            ),
        ),
        assumptions=("none is printed",),
        summary={},
    )


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    whole = joined("Both", "seed 1", [("r", report("Ranking", first=True)), ("a", report("Allocation", first=True))])
    write_document(whole, folder)
    return folder / "report.html"


def test_a_page_is_sound_and_begins_with_answer_and_drawing(written):
    text = written.read_text(encoding="utf-8")
    page = Page(text)
    assert not page.faults and not page.open
    assert len(page.names) == len(set(page.names))
    assert page.links and all(link.startswith("#") and link[1:] in page.names for link in page.links)
    assert page.pictures == 2  # the frames; charts are drawn from their records when the page is opened
    assert text.count('class="figure"') == 4
    for table in page.tables:
        assert len(set(table)) == 1
    assert page.headings[:4] == ["Both", "Allocation", "Ranking", "What to write"]
    assert text.index("Allocation: sentence 0") < text.index("Ranking: sentence 0") < text.index("<nav>")
    assert text.index("Allocation drawing" if "Allocation drawing" in text else "⌀0.0047") < text.index("<nav>")
    assert text.count("More on this answer") == 4
    for title in ("Allocation", "Ranking"):
        assert text.count(f"{title}: sentence 0") == 1 == text.count(f"{title}: sentence 5")  # none is said twice
    assert "display: table-header-group" in text
    assert "<dt>yield</dt>" in text and "<dt>preloaded</dt>" not in text


def test_a_number_is_rounded_and_says_its_exact_value():
    frame = pd.DataFrame(
        {"zone [µm]": [4.75003571846641, 4.0], "cost [cost units]": [0.8421, 12.0], "span [µm]": ["1…2", "3…4"]}
    )
    table = str(html_table(frame))
    assert '<td class="number" title="4.750035718">4.75</td>' in table
    assert '<td class="number">4</td>' in table
    assert '<td class="number" title="0.8421">0.84</td>' in table
    assert '<td class="number">1…2</td>' in table
    assert str(html_table(pd.DataFrame({"a": ["<b>"], "b [-]": [float("nan")]}))).count("&lt;b&gt;") == 1


def test_what_cannot_be_printed_is_said_before_anything_runs(tmp_path, monkeypatch):
    study = "studies/liu2020_allocation.py"
    result = tolalloc("run", study, "--pdf", "--paper", "A5", "--out", tmp_path / "run")
    refused(result, "--paper", "A4 or Letter")
    monkeypatch.setattr(pdf, "which", lambda name: None)
    refused(tolalloc("run", study, "--pdf", "--out", tmp_path / "run"), "open report.html")
    assert not (tmp_path / "run").exists()


@pytest.mark.slow
@pytest.mark.parametrize(("paper", "size"), [("A4", "594"), ("Letter", "612 x 792")])
def test_a_printed_report_has_lost_nothing(written, tmp_path, paper, size):
    if not can_print():
        pytest.skip(MISSING)
    assert not lost(written, tmp_path, paper)
    path = tmp_path / "report.pdf"
    pdf.write_pdf(written, path, paper)
    said = subprocess.run(["pdfinfo", path], capture_output=True, text=True, check=True).stdout
    assert size in said
    text = subprocess.run(["pdftotext", "-layout", path, "-"], capture_output=True, text=True, check=True).stdout
    pages = text.split("\f")
    assert 6 <= len(pages) <= 16
    for title in ("Ranking", "Allocation"):
        assert all(f"{title}.part{at}.position" in text for at in range(60))
    # The answer of the first page stands in full, that of the other report behind its heading.
    said = " ".join(text.split())
    assert "Allocation: sentence 5 on the yield." in said
    assert "Ranking: sentence 5 on the yield." not in said
    assert "More on this answer: in the report" in said
    assert text.count("⌀0.0047") == 2
    assert "Both" in pages[0] and "drawing number" in pages[0] and "⌀0.0047" in pages[0]
    continued = [page for page in pages if ".part59." in page]
    assert continued and all("zone [µm]" in page for page in continued)  # the header stands on every page of a table
    assert text.count(f"{2 * 1234.5678:.4g}") >= 30  # no column of a wide table is cut


@pytest.mark.slow
def test_a_table_that_is_wider_than_the_paper_is_noticed(written, tmp_path):
    if not can_print():
        pytest.skip(MISSING)
    page = tmp_path / "report.html"
    spoilt = "@media print { .wide { overflow: hidden; } table.data { width: 400mm; white-space: nowrap; } }</style>"
    page.write_text(written.read_text(encoding="utf-8").replace("</style>", spoilt, 1), encoding="utf-8")
    assert lost(page, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("width", [5, 50])
def test_a_word_on_two_lines_is_noticed(tmp_path, width):
    if not can_print():
        pytest.skip(MISSING)
    page = tmp_path / "report.html"
    cell = f'<td style="display: block; width: {width}mm; word-break: break-all">requirement</td>'
    page.write_text(f"<!doctype html><table><tr>{cell}</tr></table>", encoding="utf-8")
    assert lost(page, tmp_path) == (["requirement is broken"] if width == 5 else [])


def test_the_title_block_says_what_the_study_states_and_nothing_else(tmp_path):
    stated = {"drawing number": "RVX-80-101", "author": "J. <Weiß>"}
    write_document(replace(report("Ranking"), title_block=stated), tmp_path / "report")
    page = page_of(tmp_path / "report")
    assert "<td><small>drawing number</small>RVX-80-101</td>" in page
    assert "<td><small>author</small>J. &lt;Weiß&gt;</td>" in page
    assert "<td><small>revision</small></td>" in page


@pytest.mark.parametrize("block", [{"number": "1"}, {"revision": 2}, {"author": "x" * 61}, "B"])
def test_a_title_block_that_cannot_be_meant_is_refused(block):
    with pytest.raises(InputError, match="title_block"):
        ta.Study(ta.reducer("rv20e_liu2020"), ta.drawing("rv20e_table4"), limits=LIMITS, title_block=block)

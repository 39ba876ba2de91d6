"""A report of several questions: one heading each, nothing twice, a list of sections where there are many."""

from __future__ import annotations

from dataclasses import replace

import pandas as pd

from tests.builders import page_of
from tolalloc.reports.document import Document, Section, joined
from tolalloc.reports.figure import Figure, Series
from tolalloc.reports.writer import write_document

SAME = pd.DataFrame({"zone [µm]": [1.0, 2.0]})
FRONT = Figure(
    name="front",
    title="A front",
    x_label="limit [arcsec]",
    y_label="cost [cost units]",
    series=(Series(label="found", kind="line", x=[1.0, 2.0], y=[2.0, 1.0]),),
)


def report(title: str, cost: float) -> Document:
    front = pd.DataFrame({"cost [cost units]": [cost]})
    first = Section(heading=f"{title} first", figures=(FRONT,), tables=(("front", front), ("tolerances", SAME)))
    others = tuple(Section(heading=f"{title} {number}", paragraphs=("Said.",)) for number in range(3))
    return Document(
        title=title,
        subtitle="",
        answer=(f"{title} answered.",),
        warnings=("Quick run.",),
        sections=(first, *others),
        assumptions=("exact",),
        summary={"cost": cost},
    )


def test_names_stand_once_and_the_same_table_too():
    found = joined("Both", "", [("ranking", report("Ranking", 1.0)), ("allocation", report("Allocation", 2.0))], seed=1)
    assert list(found.tables) == ["front", "tolerances", "allocation front"]
    assert list(found.figures) == ["front", "allocation front"]
    assert found.warnings == ("Quick run.",)
    assert [section.part for section in found.sections] == ["Ranking"] * 4 + ["Allocation"] * 4
    assert found.summary == {"ranking": {"cost": 1.0}, "allocation": {"cost": 2.0}}


def test_a_page_of_several_questions_has_a_heading_each_and_a_list(tmp_path):
    write_document(
        joined("Both", "", [("ranking", report("Ranking", 1.0)), ("allocation", report("Allocation", 2.0))]), tmp_path
    )
    page = page_of(tmp_path)
    assert page.count('<h1 class="part">') == 2
    assert page.count('<a href="#section-') == page.count('<section id="section-') == 8


def test_a_short_page_of_one_question_has_neither(tmp_path):
    write_document(joined("Ranking", "", [("ranking", report("Ranking", 1.0))]), tmp_path)
    page = page_of(tmp_path)
    assert '<h1 class="part">' not in page
    assert '<a href="#section-' not in page


def test_what_is_better_done_first_stands_before_the_leading_answer_and_nowhere_else():
    sentence = "Before any zone is tightened: move the nominal."
    ranking = replace(report("Ranking", 1.0), answer=(sentence, "Pins drive it."), before=(sentence,))
    ranking = replace(ranking, headlines={"Ranking": (sentence, "Pins drive it.")})
    drawing = report("Allocation", 2.0)
    drawing = replace(drawing, sections=(replace(drawing.sections[0], first=True), *drawing.sections[1:]))
    found = joined("Both", "", [("ranking", ranking), ("allocation", drawing)])
    assert found.answers == (("Allocation", (sentence, "Allocation answered.")), ("Ranking", ("Pins drive it.",)))
    assert found.headlines == {"Ranking": ("Pins drive it.",)}
    assert joined("One", "", [("ranking", ranking)]).answer == (sentence, "Pins drive it.")

"""The handbook: rendered equations, pages that run, links that lead somewhere, commands said in whole sentences."""

from __future__ import annotations

import importlib
import os
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from urllib.parse import unquote

import pytest

import tolalloc as ta
from tests.studies.live_page import BROWSER, DRIVER, browser

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
TUTORIALS = sorted((DOCS / "tutorials").glob("plot_*.py"))
GALLERY = sorted((DOCS / "gallery").glob("plot_*.py"))
GUIDES = sorted(page for page in (DOCS / "how-to").glob("*.md") if page.name != "index.md")
SUBJECTS = ("first_study", "own_table", "own_function", "a_bad_unit", "own_reducer", "many_studies")
"""What the six tutorials are about."""


@pytest.fixture
def mathml(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(DOCS)
    return importlib.import_module("mathml")


def theory() -> str:
    return (DOCS / "theory.md").read_text(encoding="utf-8")


def broken_links(folder: Path) -> list[tuple[str, str]]:
    """Return the links inside a folder of pages that lead to no file or to no place in it, each with its page."""
    pages = {path.resolve(): path.read_text(encoding="utf-8") for path in folder.rglob("*.html")}
    places = {path: set(re.findall(r'\sid="([^"]+)"', text)) for path, text in pages.items()}
    broken = []
    for path, text in pages.items():
        for link in re.findall(r'<(?:a|img|link|script)\s[^>]*?(?:href|src)="([^"]*)"', text):
            if re.match(r"[a-z]+:", link):
                continue
            name, _, place = link.partition("#")
            target = (path.parent / unquote(name.partition("?")[0])).resolve() if name else path
            if not target.exists() or (place and unquote(place) not in places.get(target, {unquote(place)})):
                broken.append((path.name, link))
    return broken


def asked_of_the_network(folder: Path) -> set[str]:
    """Return the addresses that a browser would load to show the pages of a folder."""
    text = "".join(path.read_text(encoding="utf-8") for path in folder.rglob("*.html"))
    styles = "".join(path.read_text(encoding="utf-8") for path in folder.rglob("*.css"))
    loaded = re.findall(r'<(?:script|img|iframe)\s[^>]*?src="(https?:[^"]+)"', text)
    linked = re.findall(r'<link\s[^>]*?rel="stylesheet"[^>]*?href="(https?:[^"]+)"', text)
    return {*loaded, *linked, *re.findall(r"url\([\"']?(https?:[^)\"']+)", styles)}


def test_every_equation_is_converted_to_mathematics_without_a_remnant(mathml):
    displayed = re.findall(r"\$\$(.*?)\$\$", theory(), re.DOTALL)
    inside = re.findall(r"(?<!\$)\$(?!\$)([^$]+)\$", re.sub(r"\$\$.*?\$\$", "", theory(), flags=re.DOTALL))
    assert len(displayed) >= 60
    for latex in (*displayed, *inside):
        shown = re.sub(r'alttext="[^"]*"', "", mathml.mathml(mathml.TAG.sub("", latex), "block"))
        assert "\\" not in shown, latex
        assert not re.search(r">[^<]*&(?:amp;)?[^#\w]", shown), latex


def test_numbers_of_the_equations_are_whole_and_each_is_given_once():
    numbers = [int(number) for number in re.findall(r"\\tag\{(\d+)\}", theory())]
    gone = {46}  # with the measure that it was of; a number is not given again
    assert sorted(numbers) == sorted({*range(1, 111)} - gone)


def test_the_front_pages_are_as_short_as_they_promise_and_count_what_there_is():
    index = (DOCS / "index.md").read_text(encoding="utf-8")
    equations = theory().count("\\tag{")
    assert f"{equations} equations" in index
    assert f"{len(GALLERY)} pictures" in index
    for page, most in {"README.md": 400, "docs/first-study.md": 1200}.items():
        assert len((ROOT / page).read_text(encoding="utf-8").split()) <= most, page
    for path in TUTORIALS:
        assert len(path.read_text(encoding="utf-8").split()) <= 1000, path.name


def test_there_are_six_tutorials_and_fifteen_examples_each_with_a_picture():
    assert all(any(path.stem.endswith(subject) for path in TUTORIALS) for subject in SUBJECTS)
    assert len(GALLERY) >= 15
    for path in (*TUTORIALS, *GALLERY):
        text = path.read_text(encoding="utf-8")
        assert re.search(r"\.plot\(|plt\.show\(\)", text), path.name


@pytest.mark.parametrize("path", GALLERY, ids=lambda path: path.stem)
def test_an_example_says_what_to_read_off_and_shows_one_picture(path):
    text = path.read_text(encoding="utf-8")
    title, line, *_ = text.removeprefix('"""\n').splitlines()
    assert line == "=" * len(title)
    assert "**Read off it:**" in text
    assert len(re.findall(r"\.plot\(\"|plt\.show\(\)", text)) == 1


@pytest.mark.parametrize("page", GUIDES, ids=lambda page: page.stem)
def test_a_guide_has_a_picture_that_the_build_makes(page):
    pictures = re.findall(r"!\[[^\]]+\]\(([^)]+)\)", page.read_text(encoding="utf-8"))
    made = [re.fullmatch(r"\.\./_made/(\w+)/images/sphx_glr_(\w+)_\d{3}\.png", picture) for picture in pictures]
    assert made
    assert all(found and (DOCS / found[1] / f"{found[2]}.py").exists() for found in made)


def test_the_list_of_commands_says_each_in_a_whole_sentence(monkeypatch):
    monkeypatch.syspath_prepend(DOCS)
    whole = importlib.import_module("conf").whole
    cut = "* `new`: Make a folder with its...\n\n## `tolalloc new`\n\nMake a folder with its table.\n\nNext, …\n"
    page = (
        "* [`new`](#tolalloc-new): Make a folder with its table.\n\n## `tolalloc new`\n\nMake a folder with its table."
    )
    assert whole(cut) == f"{page}\n\nNext and so on\n"


def test_a_link_that_leads_nowhere_and_a_page_that_asks_the_network_are_noticed(tmp_path):
    (tmp_path / "one.html").write_text('<h1 id="top">1</h1><a href="two.html">2</a><a href="#top">1</a>')
    (tmp_path / "two.html").write_text(
        '<a class="x" href="one.html#low">1</a><img src="none.png"/><a href="https://a.b">'
    )
    assert broken_links(tmp_path) == [("two.html", "one.html#low"), ("two.html", "none.png")]
    assert not asked_of_the_network(tmp_path)
    (tmp_path / "two.html").write_text('<script async src="https://a.b/c.js"></script>')
    assert asked_of_the_network(tmp_path) == {"https://a.b/c.js"}


@pytest.fixture
def handbook(tmp_path):
    """Return the handbook that the gate has built; built here where there is none, which takes minutes."""
    if built := os.environ.get("TOLALLOC_HANDBOOK"):
        return Path(built)
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", str(DOCS), str(tmp_path)]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    return tmp_path


@pytest.mark.slow
@pytest.mark.skipif(not (BROWSER and DRIVER), reason="a browser and its driver are missing")
def test_a_page_has_no_serious_barrier(handbook):
    axe, driver = pytest.importorskip("axe_core_python.selenium").Axe(), browser()
    try:
        for name in ("index", "theory", "_made/commands", "_made/gallery/index"):
            driver.get((handbook / f"{name}.html").as_uri())
            found = [own for own in axe.run(driver)["violations"] if own["impact"] in ("serious", "critical")]
            assert [(own["id"], own["nodes"][0]["html"]) for own in found] == []
    finally:
        driver.quit()


@pytest.mark.slow
def test_the_handbook_as_it_is_built(handbook):
    assert broken_links(handbook) == []
    assert asked_of_the_network(handbook) == set()

    page = (handbook / "theory.html").read_text(encoding="utf-8")
    numbered = re.findall(r'<div class="equation" id="equation-\d+"><div class="formula"><math ', page)
    assert len(numbered) >= 60
    assert (handbook / "_static" / "math.woff").stat().st_size > 100_000

    commands = (handbook / "_made" / "commands.html").read_text(encoding="utf-8")
    assert "…" not in commands
    assert not re.search(r"\w\.\.\.</p>", commands)

    names = (handbook / "reference" / "api.html").read_text(encoding="utf-8")
    for name in ta.__all__:
        assert re.search(rf'href="python\.html#(module-)?tolalloc\.{name}"', names), name

    images = [path.name for path in (handbook / "_images").glob("sphx_glr_*.png")]
    run = re.compile(os.environ.get("TOLALLOC_SCRIPTS", r"\.py$"))
    for path in (*TUTORIALS, *GALLERY):
        made = any(name.startswith(f"sphx_glr_{path.stem}_0") for name in images)
        assert made or not run.search(path.as_posix()), path.stem

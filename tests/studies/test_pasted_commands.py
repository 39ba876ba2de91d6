"""Every command that a page shows can be pasted, beside the folder that ``tolalloc new mine --with all`` makes.

In the default run every line is read as the command line reads it, with files that are there or that a line above it
makes; nothing is solved. The slow test runs what takes seconds. Of commands that take minutes it runs ``check`` on
every study that they name, and no more: ``tests/studies/test_every_study.py`` runs the shipped studies, and each of
those commands has its own tests.
"""

from __future__ import annotations

import re
import shlex
from itertools import chain, pairwise
from pathlib import Path

import pytest
from typer.main import get_command

from tests.studies import command
from tests.studies.command import ROOT, tolalloc
from tolalloc.cli.main import app

PAGES = ("README.md", *sorted(str(path.relative_to(ROOT)) for path in (ROOT / "docs").rglob("*.md")))
COMMANDS = get_command(app).commands
WRITES = ("--out", "--write", "--profile")
"""Options that name what a command makes."""
MINUTES = ("run", "rank", "allocate", "series", "open", "diagnose", "simulate", "mount", "compare")
"""Commands that take minutes, wait for a person, or read what these have made."""
NEW = ["new", "mine", "--like", "rv40e", "--cranks", "3", "--with", "all"]


def shown(page: str) -> list[list[str]]:
    """Return the lines of a page's shell blocks."""
    return lines_of((ROOT / page).read_text(encoding="utf-8"))


def lines_of(text: str) -> list[list[str]]:
    """Return the lines of a text's shell blocks, in words without the comment."""
    blocks = re.findall(r"^```sh\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    return [words for block in blocks for line in block.splitlines() if (words := shlex.split(line, comments=True))]


LINES = {page: lines for page in PAGES if (lines := shown(page))}


def folder(place: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Make the folder of a reader who has cloned the repository, and work there."""
    (place / "studies").symlink_to(ROOT / "studies")
    monkeypatch.setattr(command, "ROOT", place)
    assert tolalloc(*NEW).returncode == 0
    return place


def made_by(words: list[str]) -> set[str]:
    """Return what a line makes."""
    if words[0] in ("cp", "sed"):
        return {words[-1]}
    made = {after for word, after in pairwise(words) if word in WRITES}
    return made | ({words[2]} if words[1] == "new" else {"runs"} if words[1] == "run" and not made else set())


def expanded(word: str, place: Path) -> list[str]:
    """Return a word as the shell gives it: a pattern without quotes stands for files."""
    return sorted(str(path.relative_to(place)) for path in place.glob(word)) if word.endswith("*.py") else [word]


def read(words: list[str], made: set[str], place: Path) -> None:
    """Assert that the command line takes the words, and that every file that they name is there or was made above."""
    assert words[1] in COMMANDS
    given = list(chain.from_iterable(expanded(word, place) for word in words[2:]))
    COMMANDS[words[1]].make_context(words[1], list(given))  # refuses unknown options, missing and wrong values
    own = made_by(words)
    for word in given:
        is_path = re.fullmatch(r"[\w./-]+\.(py|csv|toml|xlsx)|(mine|runs|studies)/[\w./-]+", word)
        if is_path and word not in own:
            assert (place / word).exists() or any(word == one or word.startswith(f"{one}/") for one in made), word


@pytest.mark.parametrize("page", LINES)
def test_every_line_of_a_page_is_taken_as_it_stands(page, tmp_path, monkeypatch):
    place, made = folder(tmp_path, monkeypatch), set[str]()
    for words in LINES[page]:
        if words[:2] == ["python3", ".ci/with_environment.py"]:
            words = words[2:]
        if words[0] == "tolalloc" and words[1:] != ["--help"]:
            read(words, made, place)
        else:
            assert words[0] in ("git", ".", "tolalloc", "pytest", "ruff", ".ci/run", "cp", "sed", "sphinx-build"), words
        if words[0] in ("tolalloc", "cp", "sed"):
            own = made_by(words)
            assert words[:2] == ["tolalloc", "new"] or not own & made - {"runs"}, f"{words}: it was made above"
            made |= own


def test_every_line_of_a_new_folder_s_own_page_is_taken_as_it_stands(tmp_path, monkeypatch):
    mine = folder(tmp_path, monkeypatch) / "mine"
    lines = lines_of((mine / "README.md").read_text(encoding="utf-8"))
    assert {words[1] for words in lines} >= {
        "check",
        "open",
        "run",
        "costs",
        "identify",
        "diagnose",
        "mount",
        "assemble",
    }
    for words in lines:
        read(words, set(), mine)


def test_a_line_that_could_not_be_pasted_is_noticed(tmp_path, monkeypatch):
    place = folder(tmp_path, monkeypatch)
    read(["tolalloc", "costs", "mine/shop.csv"], set(), place)
    for wrong in ("costs shop.csv", "compare runs/a runs/b", "check studies/none.py"):
        with pytest.raises(AssertionError):
            read(["tolalloc", *wrong.split()], set(), place)
    for wrong in ("te --reducers rv20e", "mount", "te --torque strong"):
        with pytest.raises(Exception, match=r"(?i)no such option|missing|valid number"):
            read(["tolalloc", *wrong.split()], set(), place)


@pytest.mark.slow
def test_what_takes_seconds_runs_and_what_takes_minutes_is_checked(tmp_path, monkeypatch):
    place, checked = folder(tmp_path, monkeypatch), set[str]()
    lines = [words[1:] for own in LINES.values() for words in own if words[0] == "tolalloc" and words[1] in COMMANDS]
    for words in dict.fromkeys(tuple(line) for line in lines if line[0] != "new"):
        scripts = [own for word in words for own in expanded(word, place) if own.endswith(".py")]
        if words[0] in (*MINUTES, "check"):
            # What an earlier line copies from the answer of a run is not there.
            for script in scripts:
                if script not in checked and (place / script).exists():
                    result = tolalloc("check", script)
                    assert result.returncode == 0, (script, result.stderr)
                    checked.add(script)
        else:
            result = tolalloc(*words)
            assert result.returncode == 0, (words, result.stderr)
    assert len(checked) > 10

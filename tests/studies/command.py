"""The command line as a user types it: in this process, or in one of its own where a process is what is tested."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any
from unittest import mock

from tolalloc.cli.main import main

ROOT = Path(__file__).parents[2]
WIDTH = "80"


def command(*arguments: object) -> list[str]:
    """Return the command of a process with its arguments."""
    return [sys.executable, "-m", "tolalloc.cli.main", *(str(argument) for argument in arguments)]


def process(*arguments: object, **variables: str) -> subprocess.CompletedProcess[str]:
    """Run the command in a process of its own, with environment variables added."""
    environment = {**os.environ, "COLUMNS": WIDTH, **variables}
    return subprocess.run(command(*arguments), capture_output=True, text=True, cwd=ROOT, check=False, env=environment)


def tolalloc(*arguments: object, **variables: str) -> subprocess.CompletedProcess[str]:
    """Run the command in this process, with environment variables added, and return what a process would."""
    stdout, stderr, code = io.StringIO(), io.StringIO(), 0
    with (
        _as_in_a_process(["tolalloc", *map(str, arguments)], variables),
        redirect_stdout(stdout),
        redirect_stderr(stderr),
    ):
        try:
            main()
        except SystemExit as stop:
            code = stop.code if isinstance(stop.code, int) else int(stop.code is not None)
        except Exception:
            traceback.print_exc()
            code = 1
    return subprocess.CompletedProcess(arguments, code, stdout.getvalue(), stderr.getvalue())


@contextmanager
def _as_in_a_process(words: list[str], variables: dict[str, str]) -> Iterator[None]:
    """Give one call its own words, environment, folder, module search path and warnings on standard error."""
    folder = Path.cwd()
    os.chdir(ROOT)
    try:
        with (
            mock.patch.object(sys, "argv", words),
            mock.patch.object(sys.modules["__main__"], "__package__", None, create=True),  # help says "tolalloc"
            mock.patch.object(sys, "path", list(sys.path)),
            mock.patch.dict(os.environ, {"COLUMNS": WIDTH, **variables}),
            warnings.catch_warnings(),
        ):
            warnings.showwarning = _say_warning
            yield
    finally:
        os.chdir(folder)


def _say_warning(message, category, filename, lineno, file=None, line=None) -> None:
    """Print a warning where a process prints it."""
    sys.stderr.write(warnings.formatwarning(message, category, filename, lineno, line))


def refused(result: subprocess.CompletedProcess[str], *words: str) -> None:
    """Assert that it was refused in one sentence with these words."""
    assert result.returncode == 2, result.stderr
    assert "Traceback" not in result.stderr
    sentence = result.stderr.strip()
    assert sentence.splitlines()[-1].startswith("Error: ")
    for word in words:
        assert word in sentence, sentence


WRITTEN = {"report.html", "results.xlsx", "summary.json", "manifest.json"}
"""Files of every report."""


def require_offline(page: str) -> None:
    """Assert that a page draws its figures itself and asks no host for anything."""
    assert page.count("class Chart") == 1
    assert page.count('class="figure"') + page.count('class="moving"') == page.count("<figure>") > 0
    for outside in ('src="http', "src='http", 'href="http', "cdn."):
        assert outside not in page


def answer_of(*arguments: object) -> dict[str, Any]:
    """Return what a command that is not refused answers to a program."""
    result = tolalloc(*arguments, "--json")
    assert result.returncode == 0, result.stderr
    answer = json.loads(result.stdout)
    assert isinstance(answer, dict)
    return answer

"""The command line as a user types it, each time in a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def command(*arguments: object) -> list[str]:
    """Return the command with its arguments."""
    return [sys.executable, "-m", "tolalloc.cli.main", *(str(argument) for argument in arguments)]


def tolalloc(*arguments: object, **variables: str) -> subprocess.CompletedProcess[str]:
    """Run the command, with environment variables added."""
    environment = {**os.environ, **variables}
    return subprocess.run(command(*arguments), capture_output=True, text=True, cwd=ROOT, check=False, env=environment)


def refused(result: subprocess.CompletedProcess[str], *words: str) -> None:
    """Assert that it was refused in one sentence with these words."""
    assert result.returncode == 2, result.stderr
    assert "Traceback" not in result.stderr
    sentence = result.stderr.strip()
    assert sentence.splitlines()[-1].startswith("Error: ")
    for word in words:
        assert word in sentence, sentence

"""Runs that are killed at a random moment and started again: whether they end in the same bits.

    python studies/benchmarks/killed_runs.py [--kills 20] [--seed 1] [--only assemble] [--json]

A folder of three cranks that `tolalloc new` makes is asked by five commands. Each command runs once in one piece and
then, per kill, in an empty folder until it is killed (SIGKILL) at a moment uniform over the time it takes, and again
to its end; the last kill of every command comes while its report is written. Counted are the runs whose answers
(``summary.json`` and every table but those of times) equal those of the run of one piece byte for byte, and run folders
that were there before they were whole.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

COMMANDS = {
    "run": ("run", "small.py"),
    "rank": ("rank", "small.py"),
    "allocate": ("allocate", "small.py"),
    "identify": ("identify", "bench.toml", "--reducer", "reducer.toml"),
    "assemble": ("assemble", "chain.toml", "--measured", "angles.csv"),
}
STUDY = """
import tolalloc as ta

SEARCH = ta.SearchEffort(steps=2)
study = ta.Study(
    ta.reducer("reducer.toml", neglected=("*",)),
    ta.drawing("few.csv"),
    limits={ta.PEAK_TO_PEAK: ta.Limit(upper=34.0, show=ta.AtYield(target=0.95))},
    questions=(ta.Ranking(), ta.Allocation(fixed_first=False, front=False, what_if=False)),
    effort=ta.Effort(
        ranking=ta.RankingEffort(
            units=1000, sobol=ta.SobolEffort(start=16, limit=16),
            derivative_units=64, inverse_units=100, surrogate_units=128, level_units=100, level_runs=2,
            widened_units=100, permutations=20,
        ),
        allocation=ta.AllocationEffort(verification_units=512, confirmation_units=1280, search=SEARCH),
    ),
    name="killed",
)
"""
KEPT = ("id", "pin.diameter", "housing.groove.radius", "carrier.assembly", "disc1.runout")
"""First cells of the rows of the table that are kept, so that a run takes seconds."""
SAME = ("summary.json", "tables/*.csv")
TIMED = ("work.csv", "allocation work.csv", "surrogates.csv")
"""Tables that say how long something took, which no two runs share."""
POLLED = 0.002
"""Time between two looks for a report that is being written [s]."""


@dataclass(frozen=True)
class Killed:
    """What became of a run that was killed."""

    after: float  # When it was killed over how long it takes; more than 1: while the report was written [-]
    ended: bool  # Whether it had ended before
    half: bool  # Whether its folder was there without its manifest
    same: bool  # Whether the second run ended in the same bits


def started(words: tuple[str, ...], out: Path, folder: Path) -> subprocess.Popen[bytes]:
    """Start a command on one thread."""
    command = [sys.executable, "-m", "tolalloc.cli.main", *words, "--out", str(out)]
    environment = {**os.environ, "NUMBA_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    return subprocess.Popen(command, cwd=folder, env=environment, **quiet)


def answers(out: Path) -> dict[str, bytes]:
    """Return the files of a run that must be the same."""
    found = [path for name in SAME for path in sorted(out.glob(name)) if path.name not in TIMED]
    return {str(path.relative_to(out)): path.read_bytes() for path in found}


def killed(words: tuple[str, ...], whole: Path, lasts: float, folder: Path, after: float) -> Killed:
    """Kill a run and start it again."""
    with TemporaryDirectory(dir=whole.parent, prefix="killed-") as runs:
        out = Path(runs) / whole.name
        with started(words, out, folder) as running:
            begin = time.monotonic()
            while running.poll() is None and not _is_time(Path(runs), after, (time.monotonic() - begin) / lasts):
                time.sleep(POLLED)
            ended = running.poll() is not None
            running.send_signal(signal.SIGKILL)
        half = out.exists() and any(out.iterdir()) and not (out / "manifest.json").exists()
        if not ended:
            with started(words, out, folder) as again:
                again.wait()
        return Killed(after=after, ended=ended, half=half, same=out.exists() and answers(out) == answers(whole))


def _is_time(runs: Path, after: float, passed: float) -> bool:
    """Return whether a run is to be killed now."""
    return passed >= after if after <= 1 else any(runs.glob(".*.unfinished/report.html"))


def measured(commands: dict[str, tuple[str, ...]], kills: int, seed: int, folder: Path) -> dict[str, list[Killed]]:
    """Return what became of the runs of every command."""
    generator, found = np.random.default_rng(seed), {}
    rows = (folder / "zones.csv").read_text(encoding="utf-8").splitlines(keepends=True)
    few = [row for row in rows if row.split(",")[0] in KEPT]
    (folder / "few.csv").write_text("".join(few), encoding="utf-8")
    (folder / "small.py").write_text(STUDY, encoding="utf-8")
    for name, words in commands.items():
        whole = folder / "runs" / name / "whole"
        begin = time.monotonic()
        with started(words, whole, folder) as running:
            running.wait()
        lasts = time.monotonic() - begin
        if not answers(whole):
            sys.exit(f"{name}: the run of one piece has no answer.")
        moments = [*generator.uniform(0.0, 1.0, kills - 1), 2.0]
        with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
            found[name] = list(pool.map(partial(killed, words, whole, lasts, folder), moments))
        sys.stderr.write(
            f"{name}: {lasts:.1f} s in one piece, {sum(own.same for own in found[name])} of {kills} the same\n"
        )
    return found


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--kills", type=int, default=20, help="kills of each command")
    parser.add_argument("--seed", type=int, default=1, help="seed of the moments")
    parser.add_argument("--only", choices=COMMANDS, help="one command alone")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    asked = parser.parse_args()
    if asked.kills < 1:
        parser.error(f"--kills is {asked.kills}; allowed is 1 or more.")
    with TemporaryDirectory() as place:
        folder = Path(place) / "mine"
        new = ["new", str(folder), "--like", "rv40e", "--cranks", "3", "--with", "bench,assembly"]
        subprocess.run([sys.executable, "-m", "tolalloc.cli.main", *new], check=True, stdout=subprocess.DEVNULL)
        commands = {asked.only: COMMANDS[asked.only]} if asked.only else COMMANDS
        found = measured(commands, asked.kills, asked.seed, folder)
    if asked.json:
        print(json.dumps({name: [asdict(own) for own in runs] for name, runs in found.items()}, indent=2))
        return
    print(f"{'command':10}{'kills':>7}{'ended before':>14}{'half folders':>14}{'same bits':>11}")
    for name, runs in found.items():
        count = [sum(getattr(own, field) for own in runs) for field in ("ended", "half", "same")]
        print(f"{name:10}{len(runs):7}{count[0]:14}{count[1]:14}{count[2]:11}")


if __name__ == "__main__":
    main()

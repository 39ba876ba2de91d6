"""How fast peak-to-peaks are beside version 0.1, whose commit is 029e976 and whose environment is made beforehand.

    git worktree add ../first 029e976 && (cd ../first && python3 .ci/with_environment.py python -c "import tolalloc")
    python studies/benchmarks/first_version.py ../first --rounds 5

Both versions solve the same units of the baseline drawing, in turn, round after round, each in a process of its own on
all cores: with the printed stiffness (constant contact law), and ours with stiffness from dimensions too (line contact
and bearings under load) beside the constant law of 0.1. Ratios are taken within each round.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
TORQUE, SEED = -1.0, 20261124
CASES = {
    "0.1, constant law": ("first", "rv20e", "extremes"),
    "constant law": ("own", "rv20e_liu2020", "extremes"),
    "constant law with derivatives": ("own", "rv20e_liu2020", "derivatives"),
    "line contact and bearings": ("own", "rv20e", "extremes"),
}
RATIOS = {
    "constant law over 0.1": ("0.1, constant law", "constant law", 2.5),
    "line contact over 0.1's constant law": ("0.1, constant law", "line contact and bearings", 1.0),
    "with derivatives over without": ("constant law with derivatives", "constant law", 1.3),
}


def model(reducer: str) -> Any:
    """Return the equivalent model of a reducer, of either version."""
    try:
        from tolalloc.reducers.equivalent.model import EquivalentModel
        from tolalloc.reducers.reducer.files import load_reducer
    except ImportError:  # version 0.1
        from tolalloc.equivalent.model import EquivalentModel
        from tolalloc.reducer.files import load_reducer
    return EquivalentModel(load_reducer(reducer))


def serve(reducer: str, work: str, units: Path) -> None:
    """Solve the units whenever a line comes in, and say in how many seconds."""
    own, given = model(reducer), np.load(units)
    named = dict(zip(given["columns"].tolist(), given["errors"].T, strict=True))
    errors = np.zeros((given["errors"].shape[0], len(own.columns)))
    for at, column in enumerate(own.columns):
        if column in named:
            errors[:, at] = named[column]
    solve = own.peak_to_peak_derivatives if work == "derivatives" else own.extremes
    solve(errors[:8], TORQUE)
    print("ready", flush=True)
    for _ in sys.stdin:
        start = time.perf_counter()
        solve(errors, TORQUE)
        print(time.perf_counter() - start, flush=True)


def write_units(count: int, file: Path) -> None:
    """Write random units of the baseline drawing at the modification of liu2020."""
    import tolalloc as ta
    from tolalloc.capability.experiment import Experiment
    from tolalloc.drawings.seeds import SeedTree
    from tolalloc.study.prepared import Prepared

    study = ta.Study(
        ta.reducer("rv20e_liu2020"), ta.drawing("rv20e_table4"), limits={ta.PEAK_TO_PEAK: ta.Limit(upper=60.0)}
    )
    prepared = Prepared(study=study)
    kernel = prepared.model.kernel
    drawn = Experiment.of(kernel, prepared.errors, SeedTree(SEED))
    errors = kernel.errors(drawn.deviations(prepared.errors.standard_values(drawn.uniform(count))))
    np.savez(file, errors=errors, columns=np.array(kernel.model.columns))


def measured(first: Path, units: Path, rounds: int) -> dict[str, list[float]]:
    """Return the seconds of every case, round by round."""
    folders = {"first": first, "own": ROOT}
    workers = {}
    for case, (version, reducer, work) in CASES.items():
        folder = folders[version]
        command = [str(folder / ".venv" / "bin" / "python"), __file__, "--serve", reducer, work, str(units)]
        workers[case] = subprocess.Popen(
            command, cwd=folder, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
        )
    seconds: dict[str, list[float]] = {case: [] for case in CASES}
    for worker in workers.values():
        assert worker.stdout is not None and worker.stdout.readline() == "ready\n"
    for number in range(rounds):
        for case, worker in workers.items():
            assert worker.stdin is not None and worker.stdout is not None
            worker.stdin.write("go\n")
            seconds[case].append(float(worker.stdout.readline()))
        print(f"round {number + 1} of {rounds}", file=sys.stderr, flush=True)
    for worker in workers.values():
        worker.communicate()
    return seconds


def main() -> None:
    parser = argparse.ArgumentParser(description="Peak-to-peaks beside version 0.1.")
    parser.add_argument("first", type=Path, nargs="?", help="checkout of version 0.1 with its environment in .venv")
    parser.add_argument("--units", type=int, default=512, help="random units per measurement")
    parser.add_argument("--rounds", type=int, default=5, help="measurements of each")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--serve", nargs=3, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.serve:
        reducer, work, units = options.serve
        serve(reducer, work, Path(units))
        return
    if options.first is None or not (options.first / ".venv").is_dir():
        parser.error("a checkout of version 0.1 with its environment in .venv is needed.")
    with tempfile.TemporaryDirectory() as folder:
        units = Path(folder) / "units.npz"
        write_units(options.units, units)
        seconds = {
            case: np.array(own) for case, own in measured(options.first.resolve(), units, options.rounds).items()
        }
    ratios = {name: seconds[over] / seconds[under] for name, (over, under, _) in RATIOS.items()}
    if options.json:
        print(json.dumps({"units": options.units, "seconds": {case: list(own) for case, own in seconds.items()}}))
        return
    print(f"{options.units} units, {options.rounds} rounds; median, least, most")
    for case, own in seconds.items():
        rate = options.units / own
        print(f"{case:40}{np.median(rate):10,.0f}{rate.min():10,.0f}{rate.max():10,.0f} units/s")
    for name, ratio in ratios.items():
        print(f"{name:40}{np.median(ratio):10.2f}{ratio.min():10.2f}{ratio.max():10.2f}  asked {RATIOS[name][2]}")


if __name__ == "__main__":
    main()

"""Small simulated benches as files, and ways to spoil them, for the tests of ``tolalloc identify``."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import replace
from math import pi
from pathlib import Path

import numpy as np

from studies.published.measurement_folder import write_measurements
from studies.published.simulated_bench import Bench, random_units, simulated_bench
from tests.builders import baseline_errors
from tests.studies.command import tolalloc
from tolalloc.drawings.seeds import SeedTree
from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers.reducer.files import load_reducer

NAME, TRUTH, START = "crank_disc_bearing", 1.4e10, 1.09e10
NOISE = {"curve": 0.2, "loop": 0.1}
"""Standard deviation of one reading [arcsec]."""

TORQUES = 167.0 * np.array([-1.0, -0.6, -0.2, 0.2, 0.6, 1.0])
READINGS = {"curve": 6 * 72, "loop": 6 * TORQUES.size}
NOTHING = np.empty(0)
CURVES_AND_LOOPS = Bench(
    curve_torques=(-167.0,),
    curve_angles=2 * pi * np.arange(72) / 72,
    curve_noise=NOISE["curve"] * ARCSECOND,
    loop_angles=(0.5,),
    loop_torques=TORQUES,
    loop_noise=NOISE["loop"] * ARCSECOND,
)
PEAK_TO_PEAKS = Bench(
    peak_to_peak_torque=-1.0, peak_to_peak_noise=ARCSECOND, curve_angles=NOTHING, loop_torques=NOTHING
)

Change = Callable[[Path], None]


def simulated(bench: Bench, count: int, folder: Path) -> Path:
    """Write what a bench reads of a few units whose crank–disc bearings are stiffer than the preset says."""
    given, seeds = load_reducer("rv20e_liu2020"), SeedTree(7)
    true = replace(given, stiffness=replace(given.stiffness, **{NAME: TRUTH}))
    units = random_units(baseline_errors(), count, seeds.child("units"))
    write_measurements(simulated_bench(true, units, bench).measured(seeds.child("noise")), folder)
    return folder


def identify(folder: Path, *options: object, name: str = NAME) -> subprocess.CompletedProcess[str]:
    return tolalloc(
        "identify", folder / "measurement.toml", "--reducer", "rv20e_liu2020", "--parameter", name, *options
    )


def answered(result: subprocess.CompletedProcess[str]) -> dict:
    assert result.returncode == 0, result.stderr
    assert "Warning" not in result.stderr
    return json.loads(result.stdout)


def files(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def copied(folder: Path, target: Path) -> Path:
    shutil.copytree(folder, target)
    return target


def lines(name: str, change: Callable[[list[str]], object]) -> Change:
    """Return a change of the lines of a file, in place."""

    def apply(folder: Path) -> None:
        text = (folder / name).read_text(encoding="utf-8").splitlines()
        change(text)
        (folder / name).write_text("\n".join(text) + "\n", encoding="utf-8")

    return apply


def text(name: str, old: str, new: str) -> Change:
    """Return a change of the first place where a text stands in a file."""

    def apply(folder: Path) -> None:
        content = (folder / name).read_text(encoding="utf-8")
        assert old in content
        (folder / name).write_text(content.replace(old, new, 1), encoding="utf-8")

    return apply


def value(line: int, shown: str) -> Callable[[list[str]], object]:
    """Return a change of the second cell of a line."""
    return lambda rows: rows.__setitem__(line, f"{rows[line].split(',')[0]},{shown}")

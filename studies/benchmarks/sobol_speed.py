"""Speed of many Sobol indices at once against SALib's own analysis of the same answers.

Both give first-order and total indices of 9 outputs for 30 sources with intervals, in interleaved rounds:

* (a) the package, `tolalloc.sensitivity.saltelli`, whose estimates are SALib's, and the errors those of eight
  scramblings by one matrix product;
* (b) SALib, output by output, which gathers the answers of each of 100 bootstrap resamples.

The answers are those of a smooth function with interactions. Estimates, and the indices of SALib's own resamples, are
compared. Memory is the peak of what NumPy and Python allocate, traced in a run of its own, with the answers themselves
and without the interpreter and its libraries.

Last, a quick ranking of the RV-20E is timed with what SALib takes of it, sampling and analysis, which may be a tenth.
"""

from __future__ import annotations

import os
import platform
import sys
import tracemalloc
from collections.abc import Callable
from functools import partial
from importlib import import_module
from importlib.metadata import version
from time import perf_counter
from typing import Any

import numpy as np
from jaxtyping import Float
from kernel_speed import SEED, figures, progress, run_benchmark
from numpy_cores import CORES, timed
from SALib.analyze import sobol as salib

import tolalloc as ta
from tolalloc.drawings.seeds import SeedTree
from tolalloc.models.model import Evaluation
from tolalloc.sensitivity.saltelli import one_pass, saltelli_indices

SOURCES, OUTPUTS, RESAMPLES = 30, 9, 100
TARGET_RATIO = 10.0
TARGET_MEMORY = 300.0  # MiB
ALLOWED_DIFFERENCE = 1e-12
MEBIBYTE = 2**20

LARGEST_SHARE = 0.1
"""Part of a study's time that SALib may take [-]."""
SALIB = {
    "SALib.sample.sobol": "sample",
    "SALib.analyze.sobol": "analyze",
    "SALib.sample.morris": "sample",
    "SALib.analyze.morris": "analyze",
    "SALib.analyze.pawn": "analyze",
}

Answers = Float[np.ndarray, "sample output"]


def random_answers(blocks: int) -> Answers:
    """Return the answers of a random Saltelli design without BA samples, in SALib's order."""
    generator = np.random.default_rng(SEED)
    a, b = generator.normal(size=(2, blocks, SOURCES))
    weights = generator.normal(size=(2, SOURCES, OUTPUTS))
    answers = np.empty((blocks, SOURCES + 2, OUTPUTS))
    for sample in range(SOURCES + 2):
        x = b.copy() if sample == SOURCES + 1 else a.copy()
        if 1 <= sample <= SOURCES:
            x[:, sample - 1] = b[:, sample - 1]
        answers[:, sample] = x @ weights[0] + np.sin(x @ weights[1]) + 1
    return answers.reshape(-1, OUTPUTS)


def ours(answers: Answers) -> tuple[np.ndarray, np.ndarray]:
    """Return first-order and total indices of all outputs."""
    evaluation = Evaluation(values=answers, status=np.zeros(answers.shape[0], np.uint8))
    found = saltelli_indices(evaluation, SOURCES, SeedTree(SEED), resamples=RESAMPLES)
    return found.first, found.total


def theirs(answers: Answers) -> list[dict[str, Any]]:
    """Return SALib's analysis of every output."""
    problem = {"num_vars": SOURCES, "names": [f"x{at}" for at in range(SOURCES)], "bounds": [[0.0, 1.0]] * SOURCES}
    options = {"calc_second_order": False, "num_resamples": RESAMPLES, "keep_resamples": True, "seed": SEED}
    return [salib.analyze(problem, column, **options) for column in np.ascontiguousarray(answers.T)]


def difference(answers: Answers, own: tuple[np.ndarray, np.ndarray], others: list[dict[str, Any]]) -> float:
    """Return the largest difference of estimates, and of indices from the resamples that SALib drew [-]."""
    blocks = answers.shape[0] // (SOURCES + 2)
    drawn = np.random.default_rng(SEED).integers(blocks, size=(blocks, RESAMPLES))
    counts = np.array([np.bincount(column, minlength=blocks) for column in drawn.T], float)
    largest = 0.0
    for output, other in enumerate(others):
        y = np.ascontiguousarray(answers[:, output].reshape(blocks, -1).T)[np.newaxis]
        _, _, first, total, _ = one_pass(y, counts, SOURCES)
        pairs = (
            (own[0][output], other["S1"]),
            (own[1][output], other["ST"]),
            (first[0], other["S1_conf_all"]),
            (total[0], other["ST_conf_all"]),
        )
        for mine, their in pairs:
            largest = float(np.maximum(largest, np.abs(mine - their).max()))  # NaN stays NaN
    return largest


def share_of_a_study() -> dict[str, float]:
    """Return the seconds of a quick ranking, of them those of SALib, and their ratio."""
    spent = 0.0

    def clocked(own: Callable[..., Any]) -> Callable[..., Any]:
        def call(*given: Any, **named: Any) -> Any:
            nonlocal spent
            start = perf_counter()
            found = own(*given, **named)
            spent += perf_counter() - start
            return found

        return call

    study = ta.Study(
        ta.reducer("rv20e_liu2020"),
        ta.drawing("rv20e_table4"),
        limits={ta.PEAK_TO_PEAK: ta.Limit(upper=60.0)},
        questions=[ta.Ranking()],
        name="speed",
    )
    modules = {name: import_module(name) for name in SALIB}
    own = {name: getattr(module, SALIB[name]) for name, module in modules.items()}
    try:
        for name, module in modules.items():
            setattr(module, SALIB[name], clocked(own[name]))
        start = perf_counter()
        study.rank(effort="quick")
        whole = perf_counter() - start
    finally:
        for name, module in modules.items():
            setattr(module, SALIB[name], own[name])
    return {"study": whole, "SALib": spent, "ratio": spent / whole}


def peak_memory(work: Callable[[], object], answers: Answers) -> float:
    """Return the peak of what is allocated during some work, with the answers [MiB]."""
    tracemalloc.start()
    try:
        work()
        return (tracemalloc.get_traced_memory()[1] + answers.nbytes) / MEBIBYTE
    finally:
        tracemalloc.stop()


def answer(blocks: int, rounds: int) -> dict[str, Any]:
    """Return everything that the run measured."""
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")  # what others take away
    answers = random_answers(blocks)
    ours(answers)
    seconds: dict[str, list[float]] = {"package": [], "salib": []}
    apart = 0.0
    for number in range(rounds):
        spent, own = timed(partial(ours, answers))
        seconds["package"].append(spent)
        spent, others = timed(partial(theirs, answers))
        seconds["salib"].append(spent)
        apart = float(np.maximum(apart, difference(answers, own, others)))
        progress(f"round {number + 1} of {rounds}: {seconds['package'][-1]:.3f} s, SALib {seconds['salib'][-1]:.2f} s")
    memory = {
        "package": peak_memory(partial(ours, answers), answers),
        "salib": peak_memory(partial(theirs, answers[:, :1]), answers),
    }
    package, other = (np.array(seconds[name]) for name in ("package", "salib"))
    ratio, share = figures(other / package), share_of_a_study()
    return {
        "versions": {"python": platform.python_version(), "numpy": np.__version__, "SALib": version("SALib")},
        "cores": CORES,
        "load_average_before": load,
        "blocks": blocks,
        "sources": SOURCES,
        "outputs": OUTPUTS,
        "resamples": RESAMPLES,
        "rounds": rounds,
        "seconds": {"package": figures(package), "salib": figures(other)},
        "ratio": ratio,
        "peak_memory_mebibytes": memory,
        "answers_mebibytes": answers.nbytes / MEBIBYTE,
        "seconds_of_a_quick_ranking": share,
        "targets": {
            "share of SALib": {"asked": LARGEST_SHARE, "met": share["ratio"] <= LARGEST_SHARE},
            "ratio": {"asked": TARGET_RATIO, "met": ratio["median"] >= TARGET_RATIO},
            "memory": {"asked": TARGET_MEMORY, "met": memory["package"] < TARGET_MEMORY},
        },
        "difference": apart,
        "difference_allowed": ALLOWED_DIFFERENCE,
        "agrees": apart <= ALLOWED_DIFFERENCE,
    }


def table(found: dict[str, Any]) -> str:
    """Return the answer for people."""
    versions = ", ".join(f"{name} {number}" for name, number in found["versions"].items())
    lines = [
        f"{OUTPUTS} outputs, {SOURCES} sources, {found['blocks']} blocks, {RESAMPLES} resamples; "
        f"{found['rounds']} rounds, {CORES} cores, load before {found['load_average_before']:.1f}",
        versions,
        "",
        f"{'':24}{'median':>12}{'least':>12}{'most':>12}{'peak, MiB':>12}",
    ]
    for title, name in {"(a) package, s": "package", "(b) SALib, s": "salib"}.items():
        own = found["seconds"][name]
        numbers = "".join(f"{own[which]:12.3f}" for which in ("median", "least", "most"))
        lines.append(f"{title:24}{numbers}{found['peak_memory_mebibytes'][name]:12.0f}")
    numbers = "".join(f"{found['ratio'][which]:12.1f}" for which in ("median", "least", "most"))
    verdicts = (
        f"{name}: asked {target['asked']:g}, {'met' if target['met'] else 'missed'}"
        for name, target in found["targets"].items()
    )
    return "\n".join(
        [
            *lines,
            f"{'(b)/(a)':24}{numbers}",
            "",
            "; ".join(verdicts),
            f"memory counts the answers, {found['answers_mebibytes']:.0f} MiB",
            "of a quick ranking of {study:.1f} s SALib takes {SALib:.2f} s, a share of {ratio:.1%}".format(
                **found["seconds_of_a_quick_ranking"]
            ),
            f"largest difference of (a) and (b): {found['difference']:.1e}, allowed {ALLOWED_DIFFERENCE:.0e}",
        ]
    )


if __name__ == "__main__":
    sys.exit(
        run_benchmark(
            "Speed of many Sobol indices at once against SALib.",
            ("blocks", 8192, "Saltelli blocks of the answers"),
            answer,
            table,
        )
    )

"""Ten published problems as files: a folder is enough to find the published cost without this package."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq, minimize
from scipy.stats import norm

from studies.published.problems import export

CHAINS = ("reciprocal", "t_min_of_x1_is_0.25", "t_max_of_x3_is_0.30", "exponential")


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("problems") / "ten"
    export(folder, points=4000)
    return folder


def rows(path: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(path.read_text("utf-8").splitlines()))


def cheapest(problem: Path) -> float:
    """Return the least cost of normal parts of a linear output between two limits, from the files alone."""
    (output,), (limit,) = rows(problem / "linear.csv"), rows(problem / "limits.csv")
    slopes = np.array([float(value) for name, value in output.items() if name not in ("output", "constant")])
    names = [row["id"] for row in rows(problem / "tolerances.csv")]
    curves = {name: np.array([(0.0, 0.0)]) for name in names}
    for name in names:
        points = [row for row in rows(problem / "costs.csv") if row["line or group"] == name]
        curves[name] = np.array([(float(row["zone [µm]"]), float(row["cost [cost units]"])) for row in points])
    mean, lower, upper = float(output["constant"]), float(limit["lower"]), float(limit["upper"])
    kept = float(limit["target [-]"])
    sigma = brentq(lambda own: norm.cdf(upper, mean, own) - norm.cdf(lower, mean, own) - kept, 1e-3, 10.0)
    found = minimize(
        lambda zones: sum(np.interp(zone, *curves[name].T) for name, zone in zip(names, zones, strict=True)),
        [0.5 * curves[name][:, 0].max() for name in names],
        bounds=[(curves[name][0, 0], curves[name][-1, 0]) for name in names],
        constraints={"type": "ineq", "fun": lambda zones: sigma - np.linalg.norm(slopes * zones / 6)},
        method="SLSQP",
        options={"maxiter": 500, "ftol": 1e-12},
    )
    return float(found.fun)


@pytest.mark.parametrize("variant", CHAINS)
def test_the_files_of_the_gap_chain_have_its_published_cost(folder, variant):
    problem = folder / f"gap_chain_{variant}"
    published = json.loads((problem / "published.json").read_text("utf-8"))["published"]["cost"]
    assert cheapest(problem) == pytest.approx(published, rel=1e-3)  # lines between 41 zones lie above a convex cost


def test_each_folder_has_the_yield_that_it_expects(folder):
    problems = sorted(folder.iterdir())
    assert len(problems) == 10
    for problem in problems:
        (limit,), points = rows(problem / "limits.csv"), rows(problem / "points.csv")
        values = np.array([float(row[limit["output"]]) for row in points])
        share = np.mean((values >= float(limit["lower"])) & (values <= float(limit["upper"])))
        expected = json.loads((problem / "expected.json").read_text("utf-8"))
        ((estimate, _, _),) = [own["all limits"] for name, own in expected.items() if name.startswith("yield")]
        error = np.sqrt(2 * max(estimate * (1 - estimate), 1 / len(points)) / len(points))
        assert abs(share - estimate) < 4 * error, problem.name


def test_the_bearing_stack_has_its_printed_yield(folder):
    (limit,), points = rows(folder / "bearing_stack" / "limits.csv"), rows(folder / "bearing_stack" / "points.csv")
    values = np.array([float(row[limit["output"]]) for row in points])
    share = np.mean((values >= float(limit["lower"])) & (values <= float(limit["upper"])))
    assert abs(share - 0.9539) < 4 * np.sqrt(0.9539 * 0.0461 / len(points))

"""The benchmark of allocations on random reducers: what it compares, and that it keeps what it has solved."""

from __future__ import annotations

import json
import subprocess
import sys
from importlib import import_module

import numpy as np
import pytest

import tolalloc as ta
from tests.random_cases import random_rv20e, random_sources
from tests.studies.command import ROOT
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.reducers.choice import ReducerChoice
from tolalloc.study.prepared import Prepared

BENCHMARKS = ROOT / "studies" / "benchmarks"
ZONE = {"plus": 0.02, "minus": -0.02, "unit": "mm", "min": 0.005, "max": 0.1, "cost": 2}


@pytest.fixture
def compared(monkeypatch):
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    rivals = import_module("allocation_rivals")
    study = ta.Study(
        ta.model(lambda housing, shaft: housing - shaft, inputs=("housing", "shaft"), outputs=("gap [mm]",)),
        ta.Drawing.of_rows([{"id": "housing", "nominal": 30.1, **ZONE}, {"id": "shaft", "nominal": 30.0, **ZONE}]),
        limits={"gap [mm]": ta.Limit(upper=0.115, show=ta.AtYield(target=0.98))},
        questions=[ta.Allocation()],
    )
    return rivals, rivals.Compared(prepared=Prepared(study=study), seeds=SeedTree(3), units=2048)


@pytest.mark.parametrize("scale", [0.4, 2.0])
def test_designs_are_compared_where_they_just_keep_the_limits(compared, scale):
    space = compared[1].prepared.space
    found, excess = compared[1].settled(space, space.uniform(scale))
    assert -compared[0].SETTLED < excess <= 0.0
    again, _ = compared[1].settled(space, found)
    np.testing.assert_allclose(again, found, rtol=2e-3)
    # The mean of 0.1 mm and 2.054 standard deviations of √2·0.04·scale/6 mm reach 0.115 mm, to the sampling error.
    assert found[0] == pytest.approx(0.015 / (2.0537 * np.sqrt(2) * 0.04 / 6), rel=0.08)


@pytest.mark.slow
@pytest.mark.parametrize("algorithm", ["NSGA-II", "CMA-ES"])
def test_a_rival_finds_the_cheapest_gap(compared, algorithm):
    """Two zones of one cost: alike is the cheapest, whatever the units."""
    rivals, own = compared
    search = rivals.Rival(compared=own, graded=False, calls=400 * own.units, seconds=60.0)
    asked = search.search(algorithm, 1)
    best = min((cost, *design) for cost, excess, design in asked if excess <= 0)
    alike = own.settled(own.prepared.space, own.prepared.space.uniform(1.0))[0]
    assert len(asked) <= 400 + 24  # a generation that has begun is ended
    assert best[0] == pytest.approx(float(own.prepared.space.cost(alike)), rel=0.02)


def test_random_tables_fit_their_reducers():
    generator = np.random.default_rng(1)
    kinds = set()
    for number in range(20):
        reducer = random_rv20e(generator)
        kinds.add((reducer.crank_count, reducer.disc_count))
        errors = ErrorModel(random_sources(generator, reducer))
        model = ReducerChoice(reducer=reducer).bound(errors, f"random reducer {number}")
        assert set(errors.columns) <= set(model.kernel.model.columns)
        for disc, crank in np.ndindex(reducer.disc_count, reducer.crank_count):
            assert f"crank{crank + 1}.journal{disc + 1}.eccentricity.x" in errors.columns
    assert len(kinds) >= 7


@pytest.mark.slow
def test_a_study_is_solved_once(tmp_path):
    """One of the studies, with small searches: nothing verified below a printed bound, and kept ones are read."""
    words = ["--first", "4", "--studies", "1", "--calls-factor", "0.5", "--budget", "2", "--units", "512", "--json"]
    command = [sys.executable, str(BENCHMARKS / "allocation_quality.py"), *words, "--folder", str(tmp_path)]
    first = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT)
    found = json.loads(first.stdout)
    assert found["summary"]["studies"] == 1
    assert all("table" not in own["cheaper"] for own in found["studies"])
    assert found["summary"]["verified designs below a printed bound"] == 0
    files = {path: path.stat().st_mtime_ns for path in tmp_path.glob("*.json")}
    again = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT)
    assert json.loads(again.stdout) == found
    assert files == {path: path.stat().st_mtime_ns for path in tmp_path.glob("*.json")}
    assert len(list(tmp_path.glob("*.csv"))) == 1


@pytest.mark.slow
@pytest.mark.parametrize("made", ["chain", "chains", "clutch", "clutches"])
def test_quick_answers_of_own_functions_cost_half_a_percent_more_than_the_optimum_at_most(monkeypatch, made):
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    module = import_module("own_functions")
    own = getattr(module, made)()
    for seed in (41, 42):
        found = own.study(seed).allocate(effort="quick").result
        scales = np.array([source.zone * 1e3 for source in found.drawn_sources]) / (6 * own.deviations)
        assert found.met
        assert own.failing(scales) <= 1 - module.TARGET
        assert own.optimum <= found.cost * (1 + 1e-6) <= 1.005 * own.optimum

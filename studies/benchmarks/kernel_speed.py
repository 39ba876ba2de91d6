"""How fast the compiled kernel is: against the same solve in NumPy, and against what the machine can do at all.

    python studies/benchmarks/kernel_speed.py

One run measures in turn, round after round, the curves per second of random RV-20E units at 936 angles on all cores:

* (a) the compiled kernel, `EquivalentModel.equilibria`;
* (b) the same solve in NumPy, `numpy_kernel.NumpyKernel`, laid on the cores in the way that a trial finds fastest;
* (c) the machine's bound: the measured rate of a large matrix product over the least flops that a curve takes.

Tables that do not depend on the errors are made beforehand for both kernels. Ratios are taken within each round.

**The least flops.** Counted is what no implementation of this algorithm (loads as a product, Newton's method on the
condensed coordinates from the last angle's equilibrium) can leave out. All that does not depend on the unit is
tabulated; comparisons and memory are free; a multiply-add is two flops, the first product of a sum one. With C contacts
(discs × pins), n condensed coordinates (three per disc) and p pins in contact (the measured mean), an equilibrium takes

* compressions at undisplaced discs: per contact one product each for its pin's radial and tangential deviation and for
  every harmonic amplitude of the disc that is not zero, and its pin's radius deviation as it is. The deviations of the
  pins follow from the columns along the ring once per curve, and are free;
* loads: one product per entry that is not zero of the condensed table from the bilateral columns that are not zero, and
  from the torque, to the n forces and to the carrier's rotation, and n products from the discs to that rotation;
* the first evaluation, at the last angle's equilibrium: D·q (3 products, 3 additions per contact), pin forces (3
  products with k·D, 3 additions per pin in contact), S·q − f (n² products and additions);
* one step: tangent (6 additions of k·d·dᵀ per pin in contact), the symmetric system (n³/3 + 2n²), q + step;
* the second evaluation, which verifies: D·q alone; if the same pins touch, the step has led to the equilibrium.

So one solve between two evaluations is the least. Random units take more; the measured mean number of Newton steps, and
the flops of so many, are given beside it. A matrix product neither branches nor waits, so the bound is out of reach.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from typing import Any

import numba
import numpy as np
from jaxtyping import Float
from numpy_cores import ANGLES, CORES, TORQUE, TRIAL_ANGLES, numpy_curves, numpy_kernel, numpy_workers, timed, trial
from threadpoolctl import threadpool_info

from tests.random_cases import random_units
from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reducers.unit_file import load_unit

SEED = 20201121
ALLOWED_DIFFERENCE = 1e-6  # arcsec
TARGETS = {"compiled_over_numpy": 250.0, "compiled_over_bound": 0.25}
MATRIX = 3000
OVERRIDE = "OPENBLAS_CORETYPE"

Errors = Float[np.ndarray, "sample column"]


def progress(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def product_rate() -> float:
    """Return the best rate of a few large matrix products on all cores [1/s]."""
    left, right = np.random.default_rng(SEED).random((2, MATRIX, MATRIX))
    product = partial(np.matmul, left, right, out=np.empty_like(left))
    return 2 * MATRIX**3 / min(timed(product)[0] for _ in range(6))


def least_flops(model: EquivalentModel, errors: Errors) -> tuple[dict[str, float], float]:
    """Return the least flops of an equilibrium by part, derived in this file's docstring, and those of a step more."""
    some, columns = model.equilibria(errors, TORQUE), model.error_columns
    layout, tables, touching = columns.layout, some.tables, float(some.pins_in_contact.mean())
    present = np.any(columns.matrix @ errors.T != 0.0, axis=1)
    present[layout.torque] = True
    (angles, _, size), (_, discs, _, pins) = tables.load.shape, tables.contact_by_disc.shape
    radial, tangential, radius = present[layout.pin : layout.wave].reshape(3, pins).sum(axis=1)
    products = discs * (radial + tangential) + pins * np.count_nonzero(present[layout.wave : layout.tooth])
    contacts = discs * pins

    def entries(table: np.ndarray) -> float:
        kept = np.abs(table[:, : layout.torque + 1][:, present[: layout.torque + 1]])
        return np.count_nonzero(kept > 1e-12 * kept.max()) / angles  # the others are zeros but for rounding

    compressions, balance = 6.0 * contacts, 6.0 * touching + 2.0 * size**2
    step = 6.0 * touching + size**3 / 3 + 2.0 * size**2 + size
    parts = {
        "undisplaced_compressions": float(2 * products + discs * radius - contacts),
        "forces_at_undisplaced_discs": 2 * entries(tables.load) - size,
        "rotation": 2 * (entries(tables.carrier_by_load) + size) - 1,
        "first_evaluation": compressions + balance,
        "step": step,
        "second_evaluation": compressions,
    }
    return parts, compressions + balance + step


def in_numpy_order(model: EquivalentModel, errors: Errors) -> Errors:
    """Return the errors in the order of the NumPy kernel's columns."""
    known = numpy_kernel(TRIAL_ANGLES).columns
    if errors[:, [name not in known for name in model.columns]].any():
        raise ValueError("NumpyKernel does not know all columns of these units.")
    return np.ascontiguousarray(errors[:, [model.columns.index(name) for name in known]])


def newton_steps(errors: Errors) -> float:
    """Return the mean number of Newton steps of an equilibrium, counted by the NumPy kernel at a few angles."""
    kernel = numpy_kernel(TRIAL_ANGLES)
    before = kernel.newton_steps
    kernel.curves(errors, TORQUE)
    return (kernel.newton_steps - before) / (len(errors) * TRIAL_ANGLES)


def measured_rounds(model: EquivalentModel, errors: Errors, rounds: int) -> dict[str, Any]:
    """Return rates [1/s] by round, those of the trial, and the largest difference of the curves [arcsec]."""
    own = in_numpy_order(model, errors)
    rates: dict[str, list[float]] = {"compiled": [], "numpy": [], "product": []}
    difference = 0.0
    with numpy_workers() as workers:
        tried = trial(workers, own)
        best = max(tried, key=lambda arrangement: tried[arrangement])
        for number in range(rounds):
            seconds, ours = timed(partial(model.equilibria, errors, TORQUE))
            rates["compiled"].append(len(errors) / seconds)
            seconds, theirs = timed(partial(numpy_curves, workers, best, ANGLES, own))
            rates["numpy"].append(len(errors) / seconds)
            rates["product"].append(product_rate())
            apart = np.abs(ours.transmission_error - theirs).max() / ARCSECOND
            difference = float(np.maximum(difference, apart))  # NaN stays NaN
            here = ", ".join(f"{name} {values[-1]:.4g}/s" for name, values in rates.items())
            progress(f"round {number + 1} of {rounds}: {here}")
    return {"rates": rates, "tried": tried, "best": best, "difference": difference, "steps": newton_steps(own)}


def figures(rounds: np.ndarray) -> dict[str, float]:
    return {"median": float(np.median(rounds)), "least": float(rounds.min()), "most": float(rounds.max())}


def answer(samples: int, rounds: int) -> dict[str, Any]:
    """Return everything that the run measured."""
    model = EquivalentModel(load_reducer("rv20e_liu2020"))
    unit = load_unit("table4").errors(model.columns)
    errors = random_units(unit, model.columns, np.random.default_rng(SEED), samples)
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")  # what others take away
    progress(f"{load:.1f} other processes at work; compiling and making tables ...")
    parts, further = least_flops(model, errors)
    flops = sum(parts.values())
    measured = measured_rounds(model, errors, rounds)
    compiled, others, product = (np.array(measured["rates"][name]) for name in ("compiled", "numpy", "product"))
    bound = product / (ANGLES * flops)
    ratios = {"compiled_over_numpy": figures(compiled / others), "compiled_over_bound": figures(compiled / bound)}
    with_steps = flops + (measured["steps"] - 1) * further
    return {
        "versions": {"python": platform.python_version(), "numpy": np.__version__, "numba": numba.__version__},
        "blas": sorted({f"{own['internal_api']} {own.get('architecture', '')}" for own in threadpool_info()}),
        "cores": CORES,
        "load_average_before": load,
        "samples": samples,
        "rounds": rounds,
        "angles": ANGLES,
        "torque_newton_metres": TORQUE,
        "compiled_curves_per_second": figures(compiled),
        "numpy_curves_per_second": figures(others),
        "bound_curves_per_second": figures(bound),
        "product_flops_per_second": figures(product),
        "numpy_arrangement": measured["best"]._asdict(),
        "numpy_trial": [{**way._asdict(), "curves_per_second": rate} for way, rate in measured["tried"].items()],
        "ratios": ratios,
        "targets": {name: {"asked": asked, "met": ratios[name]["median"] >= asked} for name, asked in TARGETS.items()},
        "difference_arcsec": measured["difference"],
        "difference_allowed_arcsec": ALLOWED_DIFFERENCE,
        "agrees": measured["difference"] <= ALLOWED_DIFFERENCE,
        "least_flops_per_equilibrium": {**parts, "total": flops},
        "least_flops_per_curve": ANGLES * flops,
        "mean_newton_steps": measured["steps"],
        "flops_per_equilibrium_with_mean_newton_steps": with_steps,
        "compiled_over_bound_with_mean_newton_steps": ratios["compiled_over_bound"]["median"] * with_steps / flops,
    }


def table(found: dict[str, Any]) -> str:
    """Return the answer for people."""
    versions = ", ".join(f"{name} {version}" for name, version in found["versions"].items())
    lines = [
        f"RV-20E, {found['samples']} random units, {ANGLES} angles, {found['rounds']} rounds, {CORES} cores, "
        f"load before {found['load_average_before']:.1f}",
        f"{versions}; {', '.join(found['blas'])}",
        "",
        f"{'curves/s':34}{'median':>12}{'least':>12}{'most':>12}",
    ]
    rows = {"(a) compiled kernel": "compiled", "(b) NumPy": "numpy", "(c) bound of the machine": "bound"}
    for title, name in rows.items():
        own = found[f"{name}_curves_per_second"]
        lines.append(f"{title:34}{own['median']:12,.0f}{own['least']:12,.0f}{own['most']:12,.0f}")
    lines += ["", f"{'ratio':34}{'median':>12}{'least':>12}{'most':>12}{'asked':>12}"]
    for title, name in {"(a)/(b)": "compiled_over_numpy", "(a)/(c)": "compiled_over_bound"}.items():
        own, target = found["ratios"][name], found["targets"][name]
        verdict = "met" if target["met"] else "missed"
        numbers = "".join(f"{own[which]:12.3f}" for which in ("median", "least", "most"))
        lines.append(f"{title:34}{numbers}{target['asked']:12g}  {verdict}")
    lines += ["", "least flops of an equilibrium"]
    lines += [f"  {name:32}{value:12,.0f}" for name, value in found["least_flops_per_equilibrium"].items()]
    product, arrangement = found["product_flops_per_second"]["median"] / 1e9, found["numpy_arrangement"]
    return "\n".join(
        [
            *lines,
            "",
            f"matrix product: {product:.0f} Gflop/s; NumPy's best arrangement: {arrangement}",
            f"Newton steps: {found['mean_newton_steps']:.2f} in the mean; counting them, (a) reaches "
            f"{found['compiled_over_bound_with_mean_newton_steps']:.3f} of the bound",
            f"largest difference of (a) and (b): {found['difference_arcsec']:.1e}″, allowed {ALLOWED_DIFFERENCE:.0e}″",
        ]
    )


def run_benchmark(
    description: str,
    counted: tuple[str, int, str],
    answer: Callable[[int, int], dict[str, Any]],
    table: Callable[[dict[str, Any]], str],
) -> int:
    """Run a benchmark with the options of all of them; 1 if its competitors disagree.

    ``counted`` is the option that says how much is measured at a time, its default and its help.
    """
    name, default, explained = counted
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument(f"--{name}", type=int, default=default, help=explained)
    parser.add_argument("--rounds", type=int, default=5, help="measurements of each")
    options = vars(parser.parse_args())
    for count in (name, "rounds"):
        if options[count] < 1:
            parser.error(f"--{count} is {options[count]}; allowed is 1 or more.")
    if OVERRIDE in os.environ:
        # An override keeps the BLAS from this processor's own code: no matrix product would be at its best.
        progress(f"running without {OVERRIDE}={os.environ[OVERRIDE]}")
        own = {key: value for key, value in os.environ.items() if key != OVERRIDE}
        return subprocess.run([sys.executable, *sys.orig_argv[1:]], env=own, check=False).returncode
    found = answer(options[name], options["rounds"])
    print(json.dumps(found, indent=2) if options["json"] else table(found))
    return 0 if found["agrees"] else 1


if __name__ == "__main__":
    sys.exit(
        run_benchmark(
            "Speed of the compiled kernel against NumPy and the machine's bound.",
            ("samples", 4096, "random units per measurement"),
            answer,
            table,
        )
    )

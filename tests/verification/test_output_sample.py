"""Units of a design: what a linear function is asked for, and what that says."""

from dataclasses import replace

import numpy as np
import pytest

import tolalloc as ta
from tolalloc.allocation.verify.verification import Verifier
from tolalloc.drawings.seeds import SeedTree
from tolalloc.study.prepared import Prepared

NAMES = tuple(f"x{at}" for at in range(12))
WEIGHTS = np.linspace(0.3, 2.0, len(NAMES))


def total(*sizes):
    return sum(weight * size for weight, size in zip(WEIGHTS, sizes, strict=True))


def bent(*sizes):
    return total(*sizes) + 5.0 * sizes[0] ** 2


def verifier_of(function) -> Verifier:
    row = {"nominal": 0.0, "plus": 0.02, "minus": -0.02, "unit": "mm", "min": 1e-3, "max": 0.2, "cost": 1}
    study = ta.Study(
        ta.model(function, inputs=NAMES, outputs=("y [mm]",)),
        ta.Drawing.of_rows([{"id": name, **row} for name in NAMES]),
        limits={"y [mm]": ta.Limit(lower=-0.05, upper=0.05)},
    )
    own = Prepared(study=study)
    return Verifier(space=own.space, model=own.model, requirements=own.requirements, seeds=SeedTree(1), units=2**14)


def asked_of(verifier: Verifier) -> tuple[int, np.ndarray]:
    """Return how many units a verification asks a function for, and the derivatives by the zones that it found."""
    counts = list[int]()
    model = verifier.model.observed(lambda status: counts.append(status.size))
    design = replace(verifier, model=model).verify(verifier.space.uniform(1.0), "drawn")
    return sum(counts), design.by_zone


def test_a_linear_function_is_asked_for_its_values_alone(monkeypatch):
    asked, slopes = asked_of(verifier_of(total))
    assert asked == 2**14
    monkeypatch.setattr("tolalloc.allocation.space.output_sample.is_fast", lambda _: False)
    by_differences, same = asked_of(verifier_of(total))
    assert by_differences > 10 * asked
    np.testing.assert_allclose(slopes, same, rtol=1e-6)


def test_one_that_bends_is_asked_for_its_slopes():
    assert asked_of(verifier_of(bent))[0] > 2**14 + 2 * len(NAMES) * 6144


@pytest.mark.parametrize("share", [0.1, 0.9])
def test_its_slopes_are_its_weights(share):
    verifier = verifier_of(total)
    sample = verifier.sampled(verifier.space.uniform(share), "drawn")
    found = sample.exact["y [mm]"].by_column
    np.testing.assert_allclose(found, np.tile(1e3 * WEIGHTS, (len(found), 1)), rtol=1e-9)

"""Differential vectors of a datum flow chain against exact finite motions of its parts."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy.linalg import expm

from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reading.units import ARCSECOND
from tolalloc.wings.assembly.chain import ChainPart, DatumFlowChain
from tolalloc.wings.assembly.files import load_plan

LARGEST = 60 * ARCSECOND


def tree(generator: np.random.Generator, count: int = 6) -> DatumFlowChain:
    """Return parts with any axes and places, each on the datum or on any earlier part."""
    names = ["datum", *(f"part {number}" for number in range(count))]
    return DatumFlowChain(
        datum="datum",
        parts=tuple(
            ChainPart(
                name=name,
                on=names[generator.integers(at)],
                turned=tuple(generator.uniform(-3, 3, 3).tolist()),
                position=tuple(generator.uniform(-0.1, 0.1, 3).tolist()),
            )
            for at, name in enumerate(names[1:], start=1)
        ),
    )


def cross(vector: np.ndarray) -> np.ndarray:
    x, y, z = vector
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def frame(rotation: np.ndarray, position: np.ndarray) -> np.ndarray:
    return np.block([[rotation, position[:, np.newaxis]], [np.zeros((1, 3)), np.ones((1, 1))]])


def exact_frames(chain: DatumFlowChain, errors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return nominal and actual 4×4 frames; an error is a rotation and then a displacement in the part's own axes."""
    nominal = {chain.datum: np.eye(4)} | {
        part.name: frame(expm(cross(np.array(part.turned))), np.array(part.position)) for part in chain.parts
    }
    actual = {chain.datum: np.eye(4)}
    for part, error in zip(chain.parts, errors, strict=True):
        own = frame(expm(cross(error[:3])), error[3:])
        actual[part.name] = actual[part.on] @ np.linalg.inv(nominal[part.on]) @ nominal[part.name] @ own
    return np.array([nominal[name] for name in chain.names]), np.array([actual[name] for name in chain.names])


def rotation_vectors(rotations: np.ndarray) -> np.ndarray:
    """Return small rotations as vectors: a sine taken from the skew part, so that nothing cancels."""
    skew = (rotations - np.swapaxes(rotations, -1, -2)) / 2
    vectors = np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], axis=-1)
    sine = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors * np.where(sine > 0, np.arcsin(sine) / np.where(sine > 0, sine, 1), 1)


def exact_twists(chain: DatumFlowChain, errors: np.ndarray) -> np.ndarray:
    nominal, actual = exact_frames(chain, errors)
    turned = actual[:, :3, :3] @ np.swapaxes(nominal[:, :3, :3], 1, 2)
    return np.concatenate([rotation_vectors(turned), actual[:, :3, 3] - nominal[:, :3, 3]], axis=1)


def largest_tilt_error(chain: DatumFlowChain, errors: np.ndarray) -> float:
    linear = (chain.transform @ errors.ravel()).reshape(-1, 3)
    return float(np.abs(chain.finite(errors) - linear).max())


def test_finite_rotations_are_those_of_rigid_bodies(generator):
    for _ in range(20):
        chain = tree(generator)
        errors = np.concatenate([generator.uniform(-0.3, 0.3, (6, 3)), np.zeros((6, 3))], axis=1)
        np.testing.assert_allclose(chain.finite(errors[:, :3]), exact_twists(chain, errors)[:, :3], atol=1e-12)


def test_halved_errors_quarter_what_differential_vectors_miss(generator):
    for _ in range(20):
        chain, errors = tree(generator), generator.uniform(-1, 1, (6, 3))
        missed = [largest_tilt_error(chain, errors * size) for size in (0.02, 0.01, 0.005)]
        if missed[0] > 1e-12:  # a part on the datum alone misses nothing
            np.testing.assert_allclose([missed[0] / missed[1], missed[1] / missed[2]], 4, rtol=0.03)


def test_errors_of_60_arcseconds_are_missed_by_hundredths(generator):
    missed = [largest_tilt_error(tree(generator), generator.uniform(-LARGEST, LARGEST, (6, 3))) for _ in range(300)]
    assert 0.01 * ARCSECOND < max(missed) < 0.06 * ARCSECOND
    chain = load_plan("bx40e").chain  # two parts deep: half of θ1 × θ2, at most 60″·60″
    missed = [largest_tilt_error(chain, generator.uniform(-LARGEST, LARGEST, (4, 3))) for _ in range(300)]
    assert 0.01 * ARCSECOND < max(missed) < LARGEST**2


def test_rotations_about_one_axis_add_exactly():
    chain, errors = load_plan("bx40e").chain, np.zeros((4, 3))
    errors[:, 2] = [0.1, -0.2, 0.3, 0.05]
    np.testing.assert_allclose(chain.finite(errors).ravel(), chain.transform @ errors.ravel(), atol=1e-15)


def test_twists_are_rigid_motions_to_first_order(generator):
    for _ in range(20):
        chain = tree(generator)
        errors = generator.uniform(-1, 1, (6, 6)) * [1, 1, 1, 0.1, 0.1, 0.1]
        missed = []
        for size in (0.02, 0.01, 0.005):
            linear = (chain.twist_transform @ (size * errors).ravel()).reshape(6, 6)
            missed.append(np.abs(exact_twists(chain, size * errors) - linear).max(axis=0))
        moved = np.array(missed)[:, 3:].max(axis=1)
        if moved[0] > 1e-12:
            np.testing.assert_allclose([moved[0] / moved[1], moved[1] / moved[2]], 4, rtol=0.05)
        assert moved[2] < 1e-4 * np.abs(linear[:, 3:]).max() / 0.005


def test_a_tilt_moves_what_stands_on_it_by_its_reach():
    chain = DatumFlowChain(
        datum="bed",
        parts=(
            ChainPart(name="column", on="bed", position=(0.0, 0.0, 0.1)),
            ChainPart(name="head", on="column", position=(0.0, 0.0, 0.4)),
        ),
    )
    tilt = np.zeros((2, 6))
    tilt[0, 0] = 1e-3  # about x, so what is 0.3 m above moves by −0.3 mm along y
    column, head = (chain.twist_transform @ tilt.ravel()).reshape(2, 6)
    np.testing.assert_allclose(column, [1e-3, 0, 0, 0, 0, 0], atol=1e-18)
    np.testing.assert_allclose(head, [1e-3, 0, 0, 0, -3e-4, 0], atol=1e-18)


def test_angles_of_twists_are_those_of_the_angles_alone(generator):
    for _ in range(10):
        chain = tree(generator)
        blocks = chain.twist_transform.reshape(6, 6, 6, 6)
        np.testing.assert_array_equal(blocks[:, :3, :, :3].reshape(18, 18), chain.transform)
        assert not blocks[:, :3, :, 3:].any()  # a displacement turns nothing


def test_what_carries_what():
    chain = load_plan("bx40e").chain
    carries = np.kron(np.eye(2), [[1, 0], [1, 1]])
    np.testing.assert_array_equal(chain.carries, carries)
    axes = [np.eye(3), np.eye(3), np.diag([-1.0, -1.0, 1.0]), np.diag([-1.0, -1.0, 1.0])]
    expected = np.block([[carries[row, at] * axes[at] for at in range(4)] for row in range(4)])
    np.testing.assert_allclose(chain.transform, expected, atol=1e-15)


def test_columns_take_tilts_and_rotations_where_they_belong():
    chain = DatumFlowChain(
        datum="KC0",
        parts=(
            ChainPart(name="KC1", on="KC0", tilts=("crank1.tilt",), rotates=("crank1.journal1.phase",)),
            ChainPart(name="KC2", on="KC1", tilts=("disc1.tilt", "disc2.tilt")),
            ChainPart(name="KC3", on="KC2"),
        ),
    )
    orientations = np.arange(18.0).reshape(2, 3, 3)
    found = chain.columns(orientations)
    expected = {
        "crank1.tilt.x": [0, 9],
        "crank1.tilt.y": [1, 10],
        "crank1.journal1.phase": [2, 11],
        "disc1.tilt.x": [3, 12],
        "disc1.tilt.y": [4, 13],
        "disc2.tilt.x": [3, 12],
        "disc2.tilt.y": [4, 13],
    }
    assert found.keys() == expected.keys()
    for name, values in expected.items():
        np.testing.assert_array_equal(found[name], values)
    assert {name: values.shape for name, values in chain.columns(orientations[0]).items()} == dict.fromkeys(found, ())


@pytest.mark.parametrize(
    ("parts", "kind", "sentence"),
    [
        (
            [("A", "C"), ("B", "A"), ("C", "B")],
            InputError,
            "datum flow chain: part A is 'A on C on B on A'; allowed is parts that end on the datum bed.",
        ),
        (
            [("A", "bed"), ("B", "B")],
            InputError,
            "datum flow chain: part B is 'B on B'; allowed is parts that end on the datum bed.",
        ),
        (
            [("A", "bed"), ("B", "a")],
            UnknownNameError,
            "datum flow chain, part B: unknown part under on 'a'; known are A, B, bed.",
        ),
        (
            [("B", "A"), ("A", "bed")],
            InputError,
            "datum flow chain: part B is 'mounted before A'; allowed is a part after what it is on.",
        ),
        (
            [("A", "bed"), ("A", "bed")],
            InputError,
            "datum flow chain: part is 'A'; allowed is a name that no other part and no datum has.",
        ),
        (
            [("bed", "bed")],
            InputError,
            "datum flow chain: part is 'bed'; allowed is a name that no other part and no datum has.",
        ),
    ],
)
def test_parts_that_are_no_chain_are_refused(parts, kind, sentence):
    with pytest.raises(kind, match=f"^{re.escape(sentence)}$"):
        DatumFlowChain(datum="bed", parts=tuple(ChainPart(name=name, on=on) for name, on in parts))


def test_two_parts_do_not_move_the_same_column():
    with pytest.raises(InputError) as refusal:
        DatumFlowChain(
            datum="bed",
            parts=(
                ChainPart(name="A", on="bed", tilts=("disc1.tilt",)),
                ChainPart(name="B", on="A", tilts=("disc1.tilt",)),
            ),
        )
    assert str(refusal.value) == (
        "datum flow chain: column of part B is 'disc1.tilt'; allowed is a column that no other part moves, and A moves "
        "this one."
    )

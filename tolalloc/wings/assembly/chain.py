"""Datum flow chain: which key characteristic is mounted on which, and how the error of one moves the others."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial.transform import Rotation

from tolalloc.exceptions import InputError, UnknownNameError


@dataclass(frozen=True, kw_only=True)
class ChainPart:
    """One part, known by its key characteristic: the axis that it brings into the assembly."""

    name: str  # Name of the key characteristic
    on: str  # Name of the part that it is mounted on, or of the chain's datum
    # Rotation vector from the datum's axes to the part's own axes, nominal [rad]
    turned: tuple[float, float, float] = (0.0, 0.0, 0.0)
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)  # Where its axis stands, in the datum's axes, nominal [m]
    # Error columns of the equivalent model, without ``.x`` and ``.y``, that its tilt against the datum moves
    tilts: tuple[str, ...] = field(default=())
    # Error columns of the equivalent model that its rotation about the datum's axis moves
    rotates: tuple[str, ...] = field(default=())


@dataclass(frozen=True, kw_only=True)
class DatumFlowChain:
    """Parts in the order in which they are mounted, a chain or a tree from one datum."""

    datum: str  # Name of the characteristic that all others are measured against
    parts: tuple[ChainPart, ...]  # The parts in the order of assembly

    def __post_init__(self) -> None:
        names = [self.datum, *self.names]
        repeated = [name for name in names if names.count(name) > 1]
        if repeated:
            raise InputError.at("datum flow chain", "part", repeated[0], "a name that no other part and no datum has")
        on = {part.name: part.on for part in self.parts}
        for part in self.parts:
            UnknownNameError.require(f"datum flow chain, part {part.name}", "part under on", part.on, names)
            path = [part.name]
            while path[-1] in on and path.count(path[-1]) == 1:
                path.append(on[path[-1]])
            if path[-1] != self.datum:
                circle, allowed = " on ".join(path[path.index(path[-1]) :]), f"parts that end on the datum {self.datum}"
                raise InputError.at("datum flow chain", f"part {part.name}", circle, allowed)
        for at, part in enumerate(self.parts):
            if part.on not in names[: at + 1]:
                early, allowed = f"mounted before {part.on}", "a part after what it is on"
                raise InputError.at("datum flow chain", f"part {part.name}", early, allowed)
        moved = [(column, part.name) for part in self.parts for column in (*part.tilts, *part.rotates)]
        for at, (column, name) in enumerate(moved):
            if column in dict(moved[:at]):
                allowed = f"a column that no other part moves, and {dict(moved[:at])[column]} moves this one"
                raise InputError.at("datum flow chain", f"column of part {name}", column, allowed)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parts in the order of assembly."""
        return tuple(part.name for part in self.parts)

    @cached_property
    def carries(self) -> Bool[np.ndarray, "part part"]:
        """Whether the error of the second part moves the first: it is that part, or one that it stands on."""
        found = np.eye(len(self.parts), dtype=bool)
        for at, part in enumerate(self.parts):
            if part.on != self.datum:
                found[at] |= found[self.names.index(part.on)]
        return found

    @cached_property
    def axes(self) -> Float[np.ndarray, "part 3 3"]:
        """The parts' own axes in the datum's, as columns [-]."""
        return np.asarray(Rotation.from_rotvec([part.turned for part in self.parts]).as_matrix())

    @cached_property
    def transform(self) -> Float[np.ndarray, "state error"]:
        """M: orientations against the datum, in its axes, per error of the parts in their own axes [rad/rad].

        zhang2025's differential rotation vectors, theory page equation (54): d_i = Σ R_a θ_a over the part itself and
        all that it stands on; first order, `finite` is exact.
        """
        return _from_blocks(self.carries, np.broadcast_to(self.axes, (len(self.parts), *self.axes.shape)))

    @cached_property
    def twist_transform(self) -> Float[np.ndarray, "state error"]:
        """The same for twists, three rotations before three displacements of a part's axis [rad, m per rad, m].

        A rotation R_a θ_a of part a moves the axis of part i by R_a θ_a × (p_i − p_a); theory page equation (54), first
        order.
        """
        count = len(self.parts)
        position = np.array([part.position for part in self.parts])
        reach = position[:, np.newaxis] - position[np.newaxis, :]
        across = np.cross(np.moveaxis(self.axes, 2, 1)[np.newaxis], reach[:, :, np.newaxis])
        blocks = np.zeros((count, count, 6, 6))
        blocks[..., :3, :3] = blocks[..., 3:, 3:] = self.axes
        blocks[..., 3:, :3] = np.swapaxes(across, 2, 3)
        return _from_blocks(self.carries, blocks)

    def finite(self, errors: Float[np.ndarray, "part 3"]) -> Float[np.ndarray, "part 3"]:
        """Return exact rotation vectors against nominal, in the datum's axes, of errors in own axes [rad]."""
        turned: list[Rotation] = []
        for at, part in enumerate(self.parts):
            own = Rotation.from_rotvec(self.axes[at] @ errors[at])
            turned.append(own if part.on == self.datum else turned[self.names.index(part.on)] * own)
        return np.array([rotation.as_rotvec() for rotation in turned])

    def columns(self, orientations: Float[np.ndarray, "*samples part 3"]) -> dict[str, Float[np.ndarray, "*samples"]]:
        """Return the equivalent model's error columns that orientations against the datum, in its axes, make [rad]."""
        found: dict[str, Float[np.ndarray, "*samples"]] = {}
        for at, part in enumerate(self.parts):
            for name in part.tilts:
                found[f"{name}.x"], found[f"{name}.y"] = orientations[..., at, 0], orientations[..., at, 1]
            for name in part.rotates:
                found[name] = orientations[..., at, 2]
        return found


def _from_blocks(
    carries: Bool[np.ndarray, "part part"], blocks: Float[np.ndarray, "part part size size"]
) -> Float[np.ndarray, "state error"]:
    """Return the matrix of those blocks whose second part carries the first."""
    kept = np.where(carries[:, :, np.newaxis, np.newaxis], blocks, 0.0)
    side = kept.shape[0] * kept.shape[2]
    return np.asarray(kept.transpose(0, 2, 1, 3).reshape(side, side))

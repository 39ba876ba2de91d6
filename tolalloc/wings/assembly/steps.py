"""Steps of an assembly: what is mounted, turned at which effort, and measured, and all of it as a linear system."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from jaxtyping import Bool, Float
from pydantic import Field

from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reading.files import Record
from tolalloc.wings.assembly.chain import DatumFlowChain

Positive = Annotated[float, Field(gt=0, le=1e9)]
Choice = Literal["current", "mounted", "all"]
"""The part just mounted; all parts mounted so far; also those that are not there yet, as zhang2025's R = 1000 does."""


class AssemblyStep(Record):
    """One step: mount a part, measure, adjust; table ``[[step]]`` of a file."""

    mount: str  # Name of the part that is mounted
    adjust: tuple[str, ...]  # T(k): names of the parts that may be turned
    # R(k): effort of turning each of them by one unit of angle, against the precision weight [-]
    effort: dict[str, Positive] = Field(default_factory=dict)
    # C(k): what is measured against the datum, ``A``, or of one part against another, ``A - B``
    measure: tuple[str, ...] = ()


class Efforts(Record):
    """Effort of turning a part by one unit of angle over that of the precision weight; table ``[effort]`` of a file."""

    # Of the part mounted in this step; before; afterwards [-]
    just_mounted: Positive = 1.0
    mounted_earlier: Positive = 10.0
    not_mounted: Positive = 1000.0

    def of(self, part: int, step: int) -> float:
        """Return the effort of turning the part at a position in the order of assembly at a step [-]."""
        if part > step:
            return self.not_mounted
        return self.just_mounted if part == step else self.mounted_earlier


def steps_in_order(
    chain: DatumFlowChain, adjust: Choice, measure: Choice, efforts: Efforts
) -> tuple[AssemblyStep, ...]:
    """Return one step per part in the order of assembly, which adjusts and measures the chosen ones."""
    return tuple(
        AssemblyStep(
            mount=mounted,
            adjust=_chosen(chain.names, at, adjust),
            effort={name: efforts.of(place, at) for place, name in enumerate(chain.names)},
            measure=_chosen(chain.names, at, measure),
        )
        for at, mounted in enumerate(chain.names)
    )


def _chosen(names: tuple[str, ...], step: int, choice: Choice) -> tuple[str, ...]:
    return {"current": names[step : step + 1], "mounted": names[: step + 1], "all": names}[choice]


def adjustable(chain: DatumFlowChain, step: AssemblyStep) -> Bool[np.ndarray, " part"]:
    """Return which parts may be turned at a step."""
    return np.array([name in step.adjust for name in chain.names])


def efforts(chain: DatumFlowChain, step: AssemblyStep) -> Float[np.ndarray, " part"]:
    """Return the effort of turning each part at a step, 1 where none is given [-]."""
    return np.array([float(step.effort.get(name, 1.0)) for name in chain.names])


def observed(chain: DatumFlowChain, step: AssemblyStep) -> Float[np.ndarray, "reading part"]:
    """Return what is measured at a step as rows of 1, −1 and 0 over the parts [-]."""
    rows = np.zeros((len(step.measure), len(chain.parts)))
    for row, text in zip(rows, step.measure, strict=True):
        for name, sign in zip((name.strip() for name in text.split(" - ")), (1.0, -1.0), strict=False):
            row[chain.names.index(name)] += sign
    return rows


@dataclass(frozen=True, kw_only=True)
class StateSpace:
    """Steps mount → measure → adjust: z = x + F w, y = C z + v, x⁺ = z + B (u + n).

    zhang2025's equations with A = 1, in the causal order: what a step brings in is measured before it is adjusted;
    otherwise the last part's error could never be taken out.
    """

    # F(k): state per error of every part, zero for parts that the step does not mount [rad/rad]
    entering: Float[np.ndarray, "step state error"]
    # B(k): state per adjustment of every part in its own axes, zero where it may not be turned [rad/rad]
    adjusting: Float[np.ndarray, "step state adjustment"]
    effort: Float[np.ndarray, "step adjustment"]  # Diagonal of R(k) [-]
    observing: tuple[Float[np.ndarray, "_reading state"], ...]  # C(k): readings per state [-]

    @property
    def steps(self) -> int:
        """Number of steps [-]."""
        return int(self.entering.shape[0])

    @property
    def states(self) -> int:
        """Number of states [-]."""
        return int(self.entering.shape[1])


def state_space(
    chain: DatumFlowChain, steps: Sequence[AssemblyStep], transform: Float[np.ndarray, "state error"] | None = None
) -> StateSpace:
    """Return the linear system of an assembly, theory page equation (55) [rad/rad].

    First order in the angles. The transform is `DatumFlowChain.transform` unless given, or
    `DatumFlowChain.twist_transform` for six coordinates a part.
    """
    whole = chain.transform if transform is None else transform
    size = whole.shape[0] // len(chain.parts)
    mounted = np.array([[name == step.mount for name in chain.names] for step in steps])
    turned = np.array([adjustable(chain, step) for step in steps])
    return StateSpace(
        entering=whole * np.repeat(mounted, size, axis=1)[:, np.newaxis],
        adjusting=whole * np.repeat(turned, size, axis=1)[:, np.newaxis],
        effort=np.repeat([efforts(chain, step) for step in steps], size, axis=1),
        observing=tuple(np.kron(observed(chain, step), np.eye(size)) for step in steps),
    )


def check_steps(chain: DatumFlowChain, steps: Sequence[AssemblyStep], place: str) -> None:
    """Refuse steps that cannot be carried out, in a sentence about a place, such as their file.

    Parts that are not there can be turned by `steps_in_order` with ``all`` only, zhang2025's own way.
    """
    mounted: list[str] = []
    for number, step in enumerate(steps, start=1):
        where = f"{place}, step {number}"
        _check_names(chain, step, where)
        if step.mount in mounted:
            raise InputError.at(where, "mount", step.mount, "a part that is not mounted yet")
        mounted.append(step.mount)
        for what, names in (("adjust", step.adjust), ("measure", _measured(step))):
            for name in names:
                if name not in mounted:
                    raise InputError(
                        f"{where}: {what} names {name}, which is not mounted yet; allowed is {' or '.join(mounted)}."
                    )
    missing = [name for name in chain.names if name not in mounted]
    if missing:
        raise InputError.at(place, "steps", f"none mounts {missing[0]}", "steps that mount every part once")
    order = [chain.names.index(name) for name in mounted]
    if order != sorted(order):
        raise InputError.at(place, "steps", ", ".join(mounted), "the order of the parts: " + ", ".join(chain.names))


def _measured(step: AssemblyStep) -> list[str]:
    return [name.strip() for text in step.measure for name in text.split(" - ")]


def _check_names(chain: DatumFlowChain, step: AssemblyStep, where: str) -> None:
    """Refuse unknown names and measurements that are none."""
    for name in (step.mount, *step.adjust, *step.effort, *_measured(step)):
        if name not in chain.names:
            if name == chain.datum:
                allowed = f"parts alone: everything is measured against {name} anyway"
                raise InputError.at(where, "measure", name, allowed)
            if "-" in name and all(each.strip() in chain.names for each in name.split("-")):
                raise InputError.at(where, "measure", name, "one part - another, with spaces around the sign")
            raise UnknownNameError.among(where, "part", name, chain.names)
    for text in step.measure:
        parts = [name.strip() for name in text.split(" - ")]
        if len(parts) > 2 or len(set(parts)) < len(parts):
            raise InputError.at(where, "measure", text, "a part, or one part - another")

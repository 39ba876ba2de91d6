"""A user's own function or Functional Mock-up Unit as a model: ranked, judged and allocated like a reducer's."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import isclose
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.sources import LENGTHS, is_angular, neglected_columns
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.models.identity import identity
from tolalloc.models.model import ARRAY_RATE, Evaluation, Model, Observer, SettingDerivatives, unobserved
from tolalloc.models.settings import Setting, require_settings
from tolalloc.models.unit_bounds import ScaledUnits, SlopeBounds
from tolalloc.models.user_function import UserFunction, by_name
from tolalloc.reading.named_fields import is_number
from tolalloc.reading.units import MILLIMETRE

_STEP = 1e-4
"""Step of a difference to either side, over the zone, for a function without noise [-]."""
_AT_ONCE = 2**16
"""Samples that a function is given at once, so that its arguments stay small [-]."""
_ASKED = 16
"""Samples that tell whether a function takes whole columns [-]."""
_REFUTING = 513
"""Units that may refute stated slopes, every second one in the middle [-]."""
_ROUNDED = 1e-9
"""Part of an output by which rounding may move it [-]."""
_STEP_OF_SIMULATION = 0.02
"""Step of such a difference for a simulation, whose solver leaves noise, over the zone [-]."""


@dataclass(frozen=True)
class SimulatedUnit:
    """A unit as a function of its parameters, one sample a call."""

    path: Path  # The file
    # What is set before, and read after a simulation
    parameters: tuple[str, ...]
    variables: tuple[str, ...]
    stop_time: float  # Simulated time [s]
    engine: Any  # The library

    def __call__(self, *values: float) -> list[float]:
        """Return the variables at the end of a simulation with these parameters; one without an end is a ValueError."""
        start = {name: float(value) for name, value in zip(self.parameters, values, strict=True)}
        try:
            found = self.engine.simulate_fmu(
                str(self.path), start_values=start, output=list(self.variables), stop_time=self.stop_time
            )
        except TypeError:
            raise
        except Exception as error:
            raise ValueError(f"{self.path}: {error}") from None
        return [float(found[name][-1]) for name in self.variables]


@dataclass(frozen=True, kw_only=True)
class FunctionModel:
    """A function of the dimensions on a drawing."""

    # Takes the inputs in their order, then the settings; returns the output, or a sequence of outputs. An input is the
    # nominal plus the deviation [mm, or in where its row is in inches], of an angle the deviation [rad]; a function may
    # take arrays of samples, each output then being a number or one number per sample, or single numbers
    function: Callable[..., Any]
    inputs: tuple[str, ...]  # Names of the inputs: ids of the drawing, for positions ``id.x`` and ``id.y``
    outputs: tuple[str, ...]  # Names of the outputs with their units
    settings: tuple[Setting, ...] = ()  # What the designer chooses beside the zones
    # Takes what the function takes and returns, for every output, the derivative by every input [unit of the output per
    # mm or in]; central differences unless given
    jacobian: Callable[..., Any] | None = None
    # Output → input or setting → its least and largest derivative wherever the function is asked; some units check it
    # [unit of the output per mm or in, per rad, per unit of the setting]
    slopes: Mapping[str, Mapping[str, tuple[float, float]]] = field(default_factory=dict)
    step: float = _STEP  # Step of these differences to either side, over the zone [-]
    # Input → its nominal size where the row of the drawing states none [mm, or in where its row is in inches, of angles
    # rad]
    nominals: Mapping[str, float] = field(default_factory=dict)
    neglected: tuple[str, ...] = ()  # Patterns of inputs that a drawing may leave out, at their nominal size
    name: str = "own model"  # What a report calls the model

    def __post_init__(self) -> None:
        for field_name, names in (("inputs", self.inputs), ("outputs", self.outputs)):
            if not names or len(set(names)) != len(names):
                raise InputError.at(f"model {self.name}", field_name, names, "one name or more, each once")
        for output in self.outputs:
            if not re.fullmatch(r".*\S \[\S.*\]", output):
                allowed = f"a name with its unit, such as '{output} [mm]', or [-] for a plain number"
                raise InputError.at(f"model {self.name}", "outputs", output, allowed)
        for name, nominal in self.nominals.items():
            if not is_number(nominal) or not np.isfinite(nominal):
                raise InputError.at(f"model {self.name}, inputs", name, nominal, "a finite number, its nominal size")
        self._require_slopes()
        self.callable  # noqa: B018  # says what is wrong with the names before anything is solved

    @cached_property
    def callable(self) -> Callable[..., Any]:
        """The function of inputs, then settings, in their order; its parameters of these names may have another one."""
        names = (*self.inputs, *(setting.name for setting in self.settings))
        return by_name(self.function, names, f"model {self.name}")

    def _require_slopes(self) -> None:
        """Raise unless slopes are stated of outputs of the model, by all of its inputs and settings, as two numbers."""
        named, place = [*self.inputs, *(setting.name for setting in self.settings)], f"model {self.name}, slopes"
        if not isinstance(self.slopes, Mapping):
            raise InputError.at(f"model {self.name}", "slopes", self.slopes, "output → input → two numbers")
        for output, slopes in self.slopes.items():
            UnknownNameError.require(place, "output", output, self.outputs)
            if not isinstance(slopes, Mapping):
                raise InputError.at(place, output, slopes, "input → its least and its largest derivative")
            for name in slopes:
                UnknownNameError.require(f"{place} of {output}", "input", name, named)
            for name in named:
                if not _is_range(slopes.get(name)):
                    allowed = "two finite numbers, its least and its largest derivative"
                    raise InputError.at(f"{place} of {output}", name, slopes.get(name), allowed)

    def set_to(self, settings: Mapping[str, float]) -> FunctionModel:
        """Return the function with other values of its settings [units of their names]."""
        require_settings(f"model {self.name}", self.settings, settings)
        changed = (replace(own, value=settings.get(own.name, own.value)) for own in self.settings)
        return replace(self, settings=tuple(changed))

    @property
    def source_names(self) -> tuple[str, ...]:
        """Names of the sources that the inputs are, or coordinates of."""
        return tuple(dict.fromkeys(re.sub(r"\.[xy]$", "", name) for name in self.inputs))

    def leaving_out(self, patterns: Sequence[str]) -> FunctionModel:
        """Return the function with inputs that a drawing may leave out, which then are of their nominal size."""
        return replace(self, neglected=(*self.neglected, *patterns))

    def bound(self, errors: ErrorModel, place: str) -> BoundFunction:
        """Return the model at the sources of a drawing, which must be inputs and give all that are not left out."""
        lengths = {column: LENGTHS[own.length_name] for own in errors.sources for column in own.columns}
        for column in (*errors.columns, *errors.fixed):
            UnknownNameError.require(f"{place}, model {self.name}", "source", column, self.inputs)
        given = {*errors.columns, *errors.fixed}
        left_out = neglected_columns(self.neglected, [*self.nominals]) - given
        missing = [name for name in self.inputs if name not in given and name not in left_out]
        if missing:
            raise InputError(
                f"{place}, model {self.name}: the input {missing[0]!r} has no row in the drawing; give it one, with "
                "zone 0 if it does not vary, or a nominal size in inputs and name it under neglected in the study."
            )
        return BoundFunction(
            source=self,
            varied=errors.columns,
            steps=self.step * np.repeat(errors.zones, [len(source.columns) for source in errors.active]),
            offsets=np.array([self._nominal(name, errors, lengths, place) for name in self.inputs]),
            values=tuple(setting.value for setting in self.settings),
            lengths=tuple(lengths.get(name, MILLIMETRE) for name in self.inputs),
            left_out=(f"not in the tolerance table and taken as exact: {', '.join(sorted(left_out))}",)
            * bool(left_out),
        )

    def _nominal(self, name: str, errors: ErrorModel, lengths: Mapping[str, float], place: str) -> float:
        """Return where an input stands without its deviation: the nominal size of its row, or else of the model [m]."""
        drawn = {source.name: source.nominal for source in errors.sources}.get(name, 0.0)
        stated = self.nominals.get(name, 0.0) * (1.0 if is_angular(name) else lengths.get(name, MILLIMETRE))
        if drawn and stated and not isclose(drawn, stated, rel_tol=1e-9):
            raise InputError(
                f"{place}, model {self.name}: the nominal size of {name!r} is {self.nominals[name]:g} in inputs and "
                f"{drawn / lengths[name]:g} in its row of the drawing; allowed is one of the two, or the same in both."
            )
        return (drawn or stated) + errors.fixed.get(name, 0.0)


@dataclass(frozen=True, kw_only=True)
class BoundFunction(Model):
    """A function at the sources of a drawing."""

    source: FunctionModel  # The function with its names
    varied: tuple[str, ...]  # Names of the inputs that vary, in the order of X
    steps: Float[np.ndarray, " column"]  # Step of every varied input to either side of a difference [m, angles rad]
    offsets: Float[np.ndarray, " input"]  # Nominal of every input, with what a zone of 0 leaves it [m, angles rad]
    # Unit in which every input reaches the function: millimetre or inch; no matter for an angle [m]
    lengths: tuple[float, ...]
    values: tuple[float, ...] = ()  # Values of the settings in force [units of their names]
    asked: tuple[str, ...] = ()  # Names of the outputs that a call returns; all unless given
    observe: Observer = unobserved  # Told the statuses of each call
    left_out: tuple[str, ...] = ()  # What binding the drawing to the function assumed

    @property
    def name(self) -> str:
        """The name that its user gave."""
        return self.source.name

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the inputs that vary."""
        return self.varied

    @property
    def without_nominal(self) -> tuple[str, ...]:
        """Inputs that the drawing gives no nominal size: one that was forgotten moves every output."""
        return tuple(name for name, offset in zip(self.source.inputs, self.offsets, strict=True) if offset == 0.0)

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the outputs with their units."""
        return self.asked or self.source.outputs

    @property
    def settings(self) -> tuple[Setting, ...]:
        """What the designer chooses beside the zones."""
        return self.source.settings

    @property
    def exact(self) -> tuple[str, ...]:
        """All outputs: a function is cheap enough for differences where it has no derivatives."""
        return self.source.outputs

    @cached_property
    def stated_rate(self) -> float:
        """Much higher for a function that takes whole columns [1/s]."""
        widths = self.steps / self.source.step
        units = np.random.default_rng(0).uniform(-0.5, 0.5, (_ASKED, widths.size))  # no input moves as another one
        arguments = self._arguments(units * widths)
        return ARRAY_RATE if self._user_function.takes_columns(arguments) else super().stated_rate

    @property
    def content(self) -> Any:
        """What its user gave, the function with all that it holds, and where its inputs stand."""
        return identity((self.source, self.offsets, self.lengths))

    def observed(self, observe: Observer) -> BoundFunction:
        """Return the model that tells someone the statuses of each call, those of differences among them."""
        return replace(self, observe=observe)

    def at(self, values: Float[np.ndarray, " setting"]) -> BoundFunction:
        """Return the model at other values of its settings."""
        return replace(self, values=tuple(float(value) for value in values))

    def reading(self, outputs: tuple[str, ...]) -> BoundFunction:
        """Return the response of these outputs alone."""
        for name in outputs:
            UnknownNameError.require(f"model {self.name}", "output", name, self.source.outputs)
        return replace(self, asked=outputs)

    def __call__(self, x: Float[np.ndarray, "sample column"]) -> Evaluation:
        """Return the outputs of every sample; one for which the function raises or returns no number fails."""
        found = self._called(self._user_function, x)
        values = found[:, [self.source.outputs.index(name) for name in self.outputs]]
        status = np.where(np.isfinite(values).all(axis=1), 0, 1).astype(np.uint8)
        self.observe(status)
        return Evaluation(values=values, status=status)

    def with_derivatives(self, x: Float[np.ndarray, "sample column"]) -> SettingDerivatives:
        """Return the first output of every sample with its derivatives."""
        return self.derivatives(self.outputs[0], x)

    def derivatives(self, output: str, x: Float[np.ndarray, "sample column"]) -> SettingDerivatives:
        """Return an output of every sample with its derivatives, by the user's jacobian or by central differences."""
        own = self.reading((output,))
        found, settings = own(x), np.array(self.values)
        by_setting = np.empty((x.shape[0], settings.size))
        for at, setting in enumerate(self.settings):
            step = setting.step * np.eye(settings.size)[at]
            by_setting[:, at] = (own.at(settings + step)(x).values - own.at(settings - step)(x).values)[:, 0]
            by_setting[:, at] /= 2 * setting.step
        return SettingDerivatives(evaluation=found, by_column=self._by_column(own, x), by_setting=by_setting)

    def _by_column(
        self, own: BoundFunction, x: Float[np.ndarray, "sample column"]
    ) -> Float[np.ndarray, "sample column"]:
        """Return the derivative of one output by every column [unit of the output per m]."""
        if self.source.jacobian is not None:
            inputs, outputs = len(self.source.inputs), len(self.source.outputs)
            names = (*self.source.inputs, *(setting.name for setting in self.settings))
            jacobian = by_name(self.source.jacobian, names, f"model {self.name}, jacobian")
            asked = UserFunction(function=jacobian, values=inputs * outputs, place=f"model {self.name}")
            found = self._called(asked, x).reshape(-1, outputs, inputs)
            varied = [self.source.inputs.index(name) for name in self.varied]
            own_rows = found[:, self.source.outputs.index(own.outputs[0])]
            return np.asarray(own_rows[:, varied] * self._per_input[varied])
        slopes = np.empty(x.shape)
        for at, step in enumerate(np.diag(self.steps)):
            slopes[:, at] = (own(x + step).values - own(x - step).values)[:, 0] / (2 * self.steps[at])
        return slopes

    @cached_property
    def _places(self) -> slice | list[int]:
        """Where the inputs that vary stand among all."""
        places = [self.source.inputs.index(name) for name in self.varied]
        first, last = min(places, default=0), max(places, default=-1)
        return slice(first, last + 1) if places == [*range(first, last + 1)] else places

    @cached_property
    def _per_input(self) -> Float[np.ndarray, " input"]:
        """Input per metre, or per radian for an angle: lengths reach the function in the unit of their row."""
        return np.array(
            [
                1.0 if is_angular(name) else 1.0 / length
                for name, length in zip(self.source.inputs, self.lengths, strict=True)
            ]
        )

    rests_on = "the stated slopes"
    """What its bounds rest on, beside the function."""

    def unbounded(self, output: str) -> str:
        """Return why nothing is certain of an output: its user states no slopes, or some that its units refute."""
        if output not in self.source.slopes:
            return f"model {self.name} states no slopes of {output}"
        count, widths = len(self.varied), self.steps / self.source.step
        x = np.random.default_rng(0).uniform(-1.0, 1.0, (_REFUTING, count)) * widths
        x[::2] = 0.0  # from the middle to each, and from each to the next middle
        values = self.reading((output,))(x).values[:, 0]
        changes, (low, high) = np.diff(x, axis=0), (own[:count] for own in self._slopes_of(output))
        least, most = (side(changes * low, changes * high).sum(axis=1) for side in (np.minimum, np.maximum))
        change, slack = np.diff(values), _ROUNDED * np.nanmax(np.abs(values), initial=0.0)
        wrong = np.flatnonzero((change < least - slack) | (change > most + slack))
        if not wrong.size:
            return ""
        at = wrong[0]
        return (
            f"model {self.name} states slopes of {output} that its units refute: between two of them they allow a "
            f"change from {least[at]:.4g} to {most[at]:.4g}, and it is {change[at]:.4g}"
        )

    def _slopes_of(self, output: str) -> tuple[Float[np.ndarray, " slope"], Float[np.ndarray, " slope"]]:
        """Return the least and the largest stated derivative by every column [unit per m], then by every setting."""
        slopes, factors = self.source.slopes[output], dict(zip(self.source.inputs, self._per_input, strict=True))
        names = (*self.varied, *(setting.name for setting in self.settings))
        low, high = np.array([np.array(slopes[name]) * factors.get(name, 1.0) for name in names]).T
        return low, high

    def unit_bounds(
        self,
        output: str,
        units: ScaledUnits,
        designs: Float[np.ndarray, "design variable"],  # noqa: ARG002
    ) -> SlopeBounds:
        """Return what the stated slopes say of an output of random units."""
        own, (low, high) = self.reading((output,)), self._slopes_of(output)

        def respond(
            x: Float[np.ndarray, "unit column"], settings: Float[np.ndarray, " setting"]
        ) -> Float[np.ndarray, " unit"]:
            return own.at(settings)(x).values[:, 0]

        return SlopeBounds(units=units, respond=respond, low=low, high=high)

    def _called(self, asked: UserFunction, x: Float[np.ndarray, "sample column"]) -> Float[np.ndarray, "sample value"]:
        """Return what a function says of every sample, NaN where it says nothing."""
        parts = np.split(x, range(_AT_ONCE, x.shape[0], _AT_ONCE))
        return np.concatenate([asked(self._arguments(part)) for part in parts])

    @property
    def _user_function(self) -> UserFunction:
        names = self.source.outputs
        return UserFunction(function=self.source.callable, values=len(names), place=f"model {self.name}", names=names)

    def _arguments(self, x: Float[np.ndarray, "sample column"]) -> Float[np.ndarray, "sample argument"]:
        """Return what the function takes: inputs [mm or in, angles rad], then settings [units of their names]."""
        count = len(self.source.inputs)
        found = np.empty((x.shape[0], count + len(self.values)))
        found[:, :count], found[:, count:] = self.offsets, self.values
        found[:, self._places] += x
        found[:, :count] *= self._per_input
        return found


def _is_range(value: object) -> bool:
    """Return whether a value is two finite numbers, the smaller one first."""
    if not isinstance(value, list | tuple) or len(value) != 2 or not all(is_number(own) for own in value):
        return False
    return bool(np.isfinite(value).all() and value[0] <= value[1])


def model(
    function: Callable[..., Any],
    inputs: Sequence[str] | Mapping[str, float],
    outputs: Sequence[str],
    settings: Sequence[Setting] = (),
    jacobian: Callable[..., Any] | None = None,
    name: str = "",
    slopes: Mapping[str, Mapping[str, tuple[float, float]]] | None = None,
) -> FunctionModel:
    """Return a model of your own: any function of the dimensions on a drawing.

    The parameters are those of `FunctionModel`; the name is the function's unless given.

    Examples
    --------
    >>> import tolalloc as ta
    >>> gap = ta.model(lambda housing, shaft: housing - shaft, inputs=("housing", "shaft"), outputs=("gap [mm]",))
    >>> gap.outputs
    ('gap [mm]',)
    """
    for field_name, names in (("inputs", inputs), ("outputs", outputs)):
        if isinstance(names, str):
            raise InputError.at("ta.model", field_name, names, f"a sequence of names, such as ({names!r},)")
    called = name or getattr(function, "__name__", "own model").replace("_", " ").replace("<lambda>", "own model")
    return FunctionModel(
        function=function,
        inputs=tuple(inputs),
        outputs=tuple(outputs),
        settings=tuple(settings),
        jacobian=jacobian,
        name=called,
        slopes=slopes or {},
        nominals={own: size for own, size in inputs.items() if size is not None} if isinstance(inputs, Mapping) else {},
    )


def from_fmu(path: str, inputs: Mapping[str, str], outputs: Mapping[str, str], stop_time: float = 1.0) -> FunctionModel:
    """Return a Functional Mock-up Unit as a model: parameters in, values at the end of a simulation out.

    Parameters
    ----------
    path
        The unit, an ``.fmu`` file (FMI 2 or 3).
    inputs
        Id of the drawing → name of the unit's parameter, which takes millimetres, or inches where its row is in
        inches (angles: radians).
    outputs
        Name of the output with its unit → name of the unit's variable.
    stop_time
        Simulated time after which the outputs are read [s].

    Raises
    ------
    InputError
        The optional library that runs such units is not installed, or there is no such file.
    """
    try:
        import fmpy
    except ImportError:
        raise InputError("Functional Mock-up Units need the optional extra: pip install -e '.[fmu]'.") from None
    if not Path(path).is_file():
        raise InputError(f"{path}: no such Functional Mock-up Unit.")
    unit = SimulatedUnit(Path(path), tuple(inputs.values()), tuple(outputs.values()), stop_time, fmpy)
    return FunctionModel(
        function=unit, inputs=tuple(inputs), outputs=tuple(outputs), step=_STEP_OF_SIMULATION, name=unit.path.stem
    )

"""What is said and shown of a model beside its numbers: words, pictures and a unit that moves, all of them optional."""

# ruff: noqa: ARG002 (a model may need what any model is handed)

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypeVar

import numpy as np
from jaxtyping import Float

from tolalloc.models.function_model import BoundFunction
from tolalloc.models.model import Model, Units
from tolalloc.reports.document import Section
from tolalloc.reports.feature_frame import FeatureFrame, Frames, callout
from tolalloc.reports.figure import Figure

if TYPE_CHECKING:
    from tolalloc.drawings.error_model import ErrorModel
    from tolalloc.drawings.sources import Source
    from tolalloc.reducers.equivalent.sources import ErrorSource

Own = TypeVar("Own", bound=Model)
Said = TypeVar("Said")


@dataclass(frozen=True)
class Examination:
    """What a check of a study says of a model and of some random units."""

    sentences: tuple[str, ...] = ()
    but: str = ""  # What speaks against the drawing, as the end of a sentence; empty if nothing
    fault: str = ""  # Why units of the drawing cannot be built, a sentence for a first page; empty if they can
    figures: Mapping[str, float] = field(default_factory=dict)  # What was counted, units in the names


@dataclass(frozen=True, kw_only=True)
class SignSketch:
    """Two positions of a grinding wheel in a groove of the part below it, whose axis lies further down."""

    part: str  # Name of the part
    caption: str  # What the amount is, and what its two signs do
    nominal: tuple[float, float]  # Height of the wheel's middle and its radius without the amount [mm of the picture]
    changed: tuple[float, float]  # The same with the amount negative [mm of the picture]
    arrow: tuple[float, float]  # Heights at which the arrow from one to the other begins and ends [mm of the picture]


class Portrait(Generic[Own]):
    """What is said and shown of any model; a subclass with ``of=`` says more of its models.

    Parameters
    ----------
    model
        The model at the sources of its drawing.

    Examples
    --------
    >>> class Stack(Model): ...
    >>> class StackPortrait(Portrait[Stack], of=Stack):
    ...     kind = "stack"
    """

    kind: ClassVar[str] = "model"
    """What a summary calls such a model."""
    simulated: ClassVar[str] = "simulated units"
    """What a sentence calls random units that the model solved."""
    settings_word: ClassVar[str] = "settings"
    """What a sentence calls all settings together."""
    uncertain_name: ClassVar[str] = "not known of the model"
    """What a summary calls what is uncertain of the model."""
    curve_height: ClassVar[str] = ""
    """Output that is the height of the first picture's curve; empty unless a model has one."""
    sign_sketches: ClassVar[tuple[SignSketch, ...]] = ()
    """Which way negative amounts are ground, as small pictures; none unless a model has any."""

    def __init__(self, model: Own) -> None:
        self.model = model

    def __init_subclass__(cls, of: type[Model] | None = None) -> None:
        if of is not None:
            _PORTRAITS[of] = cls

    def _said(self, name: str, otherwise: Said) -> Said:
        """Return what an own model says of itself under this name, as it may without a portrait."""
        said: Said = getattr(self.model, name, otherwise)
        return said

    @property
    def outcomes(self) -> Mapping[int, str]:
        """Status → outcome of a sample in words, the good one first."""
        return self._said("outcomes", {0: "answer found", 1: "no answer"})

    @property
    def facts(self) -> Mapping[str, Any]:
        """What is worth knowing of the model itself, units in the names."""
        return self._said("facts", {})

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What no source of the model states."""
        return self._said("assumptions", self.left_out)

    @property
    def left_out(self) -> tuple[str, ...]:
        """What the drawing does not state and the model takes as exact, a sentence each."""
        return self._said("left_out", ())

    @property
    def remarks(self) -> tuple[str, ...]:
        """What every report says of the model itself beside what is asked, in sentences."""
        return self._said("remarks", ())

    @property
    def risks(self) -> tuple[str, ...]:
        """What no tolerance of the drawing helps against, in sentences; nothing unless a model knows of any."""
        return ()

    @property
    def not_included(self) -> str:
        """What may move the outputs of a part in use and is not computed, as the end of a sentence."""
        return "wear and temperature"

    @property
    def spectra_note(self) -> str:
        """Which sources show at which orders, a clause that begins a sentence; nothing unless a model knows."""
        return ""

    def kind_of(self, source: Source) -> ErrorSource | None:
        """Return what the model declares of a source, which a drawing writes by it; nothing unless a model does."""
        return None

    def frame(self, source: Source) -> FeatureFrame:
        """Return what stands on the drawing for a source."""
        return callout(source, self.kind_of(source))

    def frames(self, members: Iterable[Source]) -> Frames:
        """Return the different frames of the members of a dimension."""
        return Frames(dict.fromkeys(map(self.frame, members)))

    def display_name(self, output: str) -> str:
        """Return what a sentence calls an output, which has no unit."""
        return output.split(" [")[0]

    def amounts(self, values: Float[np.ndarray, " setting"]) -> Mapping[str, float]:
        """Return what the settings mean on the drawing, units in the names."""
        return {setting.name: float(value) for setting, value in zip(self.model.settings, values, strict=True)}

    def effects(self, values: Float[np.ndarray, " setting"]) -> Mapping[str, str]:
        """Return what an amount of these settings does to the part, or a setting means; nothing unless a model says."""
        return {}

    def cautions(self, values: Float[np.ndarray, " setting"]) -> tuple[str, ...]:
        """Return what a reader must know of these settings."""
        return ()

    def examination(self, figures: Mapping[str, float]) -> Examination:
        """Return what a check says of the model and of what `Model.examined` counted of some random units."""
        return Examination()

    def illustrated(self, units: Units) -> tuple[Section, ...]:
        """Return pictures of single units, label → settings and columns; nothing unless a model has any."""
        return ()

    def pictured(self, units: Units) -> tuple[Figure, ...]:
        """Return what can be drawn of single units at once, such as a curve; nothing unless a model has any."""
        return ()

    def scene(
        self,
        settings: Float[np.ndarray, " setting"],
        x: Float[np.ndarray, " column"],
        unit: str,
        sources: tuple[str, ...],
    ) -> dict[str, Any] | None:
        """Return a unit as a moving picture needs it, with a place for each source; none unless a model has one."""
        return None

    def moving(
        self, errors: ErrorModel, x: Float[np.ndarray, " column"], shares: Mapping[str, float], unit: str
    ) -> tuple[Section, ...]:
        """Return a picture of one unit's columns whose places show the sources' shares; nothing unless there is one."""
        return ()


_PORTRAITS: dict[type[Model], type[Portrait[Any]]] = {}
_SHIPPED = {
    "tolalloc.reducers.model": "tolalloc.reports.portraits.reducer",
}
"""Module of a model → module of its portrait, which is imported when it is first asked for."""


def portrait_of(model: Model) -> Portrait[Any]:
    """Return the portrait of a model: its own, that of a base class, or the one of any model."""
    for base in type(model).__mro__:
        if base not in _PORTRAITS and base.__module__ in _SHIPPED:
            import_module(_SHIPPED[base.__module__])
        if base in _PORTRAITS:
            return _PORTRAITS[base](model)
    return Portrait(model)


def sections_of(heading: str, made: Callable[[], tuple[Section, ...]]) -> tuple[Section, ...]:
    """Return sections with pictures, or one that says why there are none: a picture never stops a report."""
    try:
        return made()
    except Exception as error:
        said = f"The pictures are left out: {str(error).rstrip('.') or type(error).__name__}."
        return (Section(heading=heading, paragraphs=(said,)),)


class FunctionPortrait(Portrait[BoundFunction], of=BoundFunction):
    """What is said of a function at the sources of a drawing."""

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What a reader must know: inputs that the drawing gives no nominal size."""
        bare = ", ".join(self.model.without_nominal)
        return (f"no nominal size on the drawing, taken as deviations from 0: {bare}",) if bare else ()

    def examination(self, figures: Mapping[str, float]) -> Examination:
        """Return which inputs have no nominal size: a size that was forgotten moves every output."""
        return Examination(tuple(f"{said[0].upper()}{said[1:]}." for said in self.assumptions))

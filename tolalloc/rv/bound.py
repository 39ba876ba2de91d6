"""A drawing bound to a reducer: which columns of the model vary, which stay where, and what is taken as exact."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.sources import neglected_columns
from tolalloc.drawings.tolerance_table import require_small_zones
from tolalloc.exceptions import InputError
from tolalloc.rv.equivalent.columns import source_name
from tolalloc.rv.equivalent.kinematics import HARMONICS
from tolalloc.rv.equivalent.model import EquivalentModel
from tolalloc.rv.reducer.design import Reducer
from tolalloc.rv.reducer.unit_file import BuiltUnit
from tolalloc.rv.response.kernel import KernelResponse
from tolalloc.units import MICROMETRE

NEGLECTED = (
    "sun.pitch",
    "planet*.pitch",
    "mesh*",
    "*.phase",
    "*.rotation",
    "*.tilt",
    "*.clearance",
    "each_pin.*",
    "*.each_tooth.*",
)
"""Sources that a tolerance table need not list; they are then taken as exact, and the report says so."""

_LARGEST_ZONE = 200.0 * MICROMETRE
"""Largest zone of a reducer's part that is believed; a metre typed for a millimetre is far above it [m]."""


@dataclass(frozen=True, kw_only=True)
class BoundReducer:
    """The equivalent model at the sources of a drawing."""

    kernel: KernelResponse  # The model at the reducer's own modification
    neglected: tuple[str, ...]  # Patterns of the sources that are taken as zero because the drawing does not list them

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What the binding assumes."""
        return (
            (f"not in the tolerance table and taken as exact: {', '.join(self.neglected)}",) if self.neglected else ()
        )


def bind(
    reducer: Reducer,
    errors: ErrorModel,
    torque: float | None,
    place: str,
    neglected: Sequence[str] = NEGLECTED,
    unit: BuiltUnit | None = None,
) -> BoundReducer:
    """Return the equivalent model at the sources of a drawing; nothing is solved.

    Parameters
    ----------
    reducer
        The reducer, with the stiffness in use.
    errors
        The sources.
    torque
        Torque on the carrier, negative where it resists the rotation; the test torque unless given [N·m].
    place
        Who asks, for messages.
    neglected
        Sources that the drawing may leave out, taken as zero; ``*`` stands for anything.
    unit
        A built unit that is to be shown; the model gets its orders.

    Raises
    ------
    InputError, UnknownNameError
        A source or torque that is not allowed, or a column of the model that nobody gives.
    """
    require_small_zones(errors.sources, _LARGEST_ZONE, place)
    orders = tuple(sorted({*errors.orders, *(unit.orders if unit else ())}))
    model = EquivalentModel(reducer, orders=orders or HARMONICS)
    listed = {*errors.columns, *errors.still}
    left_out = {pattern: neglected_columns((pattern,), model.columns) - listed for pattern in neglected}
    fixed: Mapping[str, float] = {
        **dict.fromkeys((column for columns in left_out.values() for column in columns), 0.0),
        **dict.fromkeys(_absent_orders(errors, model, place), 0.0),
        **errors.still,
        **reducer.modification.deviations,
    }
    kernel = KernelResponse(
        model=model,
        torque=reducer.torque_on_carrier(torque, place),
        columns=errors.columns,
        fixed=fixed,
    )
    if unit:
        unit.errors(model.columns, reducer.modification.deviations)
    return BoundReducer(kernel=kernel, neglected=tuple(pattern for pattern, columns in left_out.items() if columns))


def _absent_orders(errors: ErrorModel, model: EquivalentModel, place: str) -> list[str]:
    """Return the columns of listed sources whose orders their spectra do not have.

    Raises
    ------
    InputError
        A source that lists only some of its pins or teeth.
    """
    absent = []
    for source in errors.sources:
        own = [column for column in model.columns if source_name(column) == source.name]
        missing = [column for column in own if column not in source.columns]
        if missing and not source.spectrum:
            features = len({column.removesuffix(".x").removesuffix(".y") for column in own})
            raise InputError.at(
                f"{place}, tolerance table, {source.name}", "each", source.each, f"{features}, one per feature"
            )
        absent += missing
    return absent

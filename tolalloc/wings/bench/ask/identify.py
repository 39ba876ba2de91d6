"""From a measurement file to a stiffness file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, cast

from tolalloc.exceptions import InputError
from tolalloc.reports.header import Header
from tolalloc.running.progress import Progress
from tolalloc.study.answer import Answer
from tolalloc.study.inquiry import Inquiry, ReducerName, Seed, Word

if TYPE_CHECKING:
    from tolalloc.reducers.reducer.design import Reducer
    from tolalloc.wings.bench.identification import IdentificationRequest
    from tolalloc.wings.bench.measurements import Measurements
    from tolalloc.wings.bench.parameters import Parameter
    from tolalloc.wings.bench.telling.catalogue import CatalogueTeller
    from tolalloc.wings.bench.telling.identification import IdentificationTeller

NAMES = (
    "sun_support, gear_mesh, crank_disc_bearing, crank_carrier_bearing, carrier_bearing, shaft_support, "
    "eccentric_bearing, output_pin, ring_along, ring_across, ring_turn, ring_tilt_along, ring_tilt_across, "
    "pin_contact, torque, bias"
)
"""Names of `tolalloc.wings.bench.parameters.SYMBOLS`, written out so that help need not import them."""


@dataclass(frozen=True, kw_only=True)
class Identify(Inquiry["tuple[Reducer, IdentificationRequest | None, Measurements | None]"]):
    """Identify stiffnesses from measured units, and show what the measurements cannot determine."""

    word: ClassVar[str] = "identify"
    example: ClassVar[str] = "tolalloc identify mine/bench.toml --reducer mine/reducer.toml"
    by_position: ClassVar[int] = 1
    kernel: ClassVar[Literal["", "equivalent"]] = "equivalent"
    written: ClassVar[tuple[str, ...]] = ("write_to",)

    data: Annotated[Path | None, Word("Measurement file (TOML): units and their readings; none with --catalogue.")] = (
        None
    )
    reducer: ReducerName = None
    parameters: Annotated[
        list[str] | None,
        Word(
            f"Unknown as NAME or NAME=LOW:HIGH, again for each; NAME one of {NAMES}. Stiffness in "
            "N/m, bias in arcsec, torque over the stated one. Unless given: liu2020's three, of a single stage "
            "eccentric_bearing; half to double.",
            option="--parameter",
        ),
    ] = None
    priors: Annotated[
        list[str] | None,
        Word("Prior knowledge, as NAME=RELATIVE standard deviation (bias: arcsec).", option="--prior"),
    ] = None
    catalogue: Annotated[
        bool,
        Word("Instead of units: the rigidity in [catalogue], one factor on all bearings.", option="--catalogue"),
    ] = False
    seed: Seed = 1
    write_to: Annotated[
        Path | None, Word("New stiffness file to write, for --stiffness elsewhere.", option="--write")
    ] = None

    def apart_from(self, report: Path | None) -> None:
        """Refuse a stiffness file inside of the report's folder."""
        file, folder = self.write_to, report.absolute() if report else None
        if file and folder and folder in (file.absolute(), *file.absolute().parents):
            raise InputError.of_argument(self.called, "write_to", str(file), "a file outside of the report's folder")

    def prepare(self) -> tuple[Reducer, IdentificationRequest | None, Measurements | None]:
        """Return the design, and what is identified from which units; neither of them from a catalogue."""
        from tolalloc.reading.files import require_new
        from tolalloc.reducers.reducer.files import load_reducer

        design = load_reducer(str(self.reducer))
        if self.write_to:
            require_new(self.write_to)
            if self.write_to.suffix != ".toml":
                raise InputError.of_argument(self.called, "write_to", str(self.write_to), "a file that ends in .toml")
        if self.catalogue:
            given = {"a measurement file": self.data, "--parameter": self.parameters, "--prior": self.priors}
            for name, value in given.items():
                if value:
                    raise InputError(f"{self.called}: --catalogue needs no units; leave out {name}.")
            return design, None, None
        if self.data is None:
            raise InputError(f"{self.called}: a measurement file is missing; give one, or --catalogue.")
        return design, *self._from_units(design, self.data)

    def _from_units(self, design: Reducer, data: Path) -> tuple[IdentificationRequest, Measurements]:
        """Return what is identified, and the units."""
        # SciPy takes half a second to import; a misspelt file need not wait for it.
        from tolalloc.reducers.families.known import family_of
        from tolalloc.wings.bench.identification import IdentificationRequest
        from tolalloc.wings.bench.measurements import load_measurements

        asked = asked_parameters(design, self.parameters or family_of(design).identified, self.priors or ())
        request = IdentificationRequest(parameters=asked, seed=self.seed, data=str(data))
        if self.write_to and not any(item.is_stiffness for item in asked):
            allowed = "a file only where a stiffness is identified"
            raise InputError.of_argument(self.called, "write_to", str(self.write_to), allowed)
        return request, load_measurements(data)

    def solve(
        self, prepared: tuple[Reducer, IdentificationRequest | None, Measurements | None], progress: Progress
    ) -> Answer[Any]:
        """Return the stiffnesses, or the factor on all bearings that gives the rigidity of the catalogue."""
        from tolalloc.wings.bench.catalogue import identify_from_catalogue
        from tolalloc.wings.bench.identification import identify
        from tolalloc.wings.bench.telling.catalogue import CatalogueTeller
        from tolalloc.wings.bench.telling.identification import IdentificationTeller

        design, request, measurements = prepared
        if request is None or measurements is None:
            header = Header(name="catalogue", model=design.name, assumptions=design.assumptions)
            found = identify_from_catalogue(design)
            return Answer(kind="catalogue", header=header, result=found, told_by=CatalogueTeller)
        header = Header(name=measurements.name, model=design.name, seed=request.seed)
        result = identify(request, measurements, design, progress)
        return Answer(kind="identification", header=header, result=result, told_by=IdentificationTeller)

    def write(self, answer: Answer[Any]) -> tuple[str, ...]:
        """Write the stiffness file, if it was asked for."""
        from tolalloc.reducers.reducer.files import write_identified_stiffness

        stiffness = cast("IdentificationTeller | CatalogueTeller", answer.teller).stiffness
        if not (self.write_to and stiffness):
            return ()
        write_identified_stiffness(stiffness, self.write_to)
        return (f"Stiffness file: {self.write_to}",)


def asked_parameters(reducer: Reducer, asked: Sequence[str], priors: Sequence[str]) -> tuple[Parameter, ...]:
    """Return the unknowns as they are written: ``NAME`` or ``NAME=LOW:HIGH``, and ``NAME=DEVIATION``."""
    from tolalloc.wings.bench.parameters import parameter

    place, known = Identify.called, dict[str, float]()
    for text in priors:
        name, sign, number = text.partition("=")
        if not sign:
            raise InputError.of_argument(place, "priors", text, "NAME=NUMBER, such as carrier_bearing=0.1")
        if name in known:
            raise InputError.of_argument(place, "priors", text, "each parameter once")
        known[name] = _number(number, "priors", text)
    found = []
    for text in asked:
        name, sign, range_ = text.partition("=")
        low, colon, high = range_.partition(":")
        if sign and not colon:
            raise InputError.of_argument(place, "parameters", text, "NAME or NAME=LOW:HIGH, such as bias=-5:5")
        bounds = (_number(low, "parameters", text), _number(high, "parameters", text)) if sign else None
        found.append(parameter(name, reducer, bounds, known.pop(name, inf), place))
    for name in known:
        raise InputError.of_argument(place, "priors", name, "a prior of a parameter that is asked for")
    return tuple(found)


def _number(text: str, argument: str, whole: str) -> float:
    """Return a number of an argument."""
    from tolalloc.drawings.table_file import plain_number

    try:
        return plain_number(text)
    except ValueError:
        raise InputError.of_argument(Identify.called, argument, whole, f"numbers; {text!r} is none") from None

"""What tests build alike: studies, sources, units, kernels and files; what reports and refusals say, by its key."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from string import Formatter
from typing import Any

import numpy as np
import pandas as pd
import pytest

import tolalloc as ta
from tests.import_graph import PACKAGE
from tolalloc.allocation.space.design_space import DesignSpace
from tolalloc.allocation.space.requirement import AtYield, Guarantee, Requirement, RootSumSquare
from tolalloc.allocation.verify.verification import Verifier
from tolalloc.capability.indices import Limits
from tolalloc.drawings.correlation import Correlation
from tolalloc.drawings.distributions import Distribution
from tolalloc.drawings.drawing import Drawing
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.measured_parts import MeasuredParts, StatedProcess
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.sources import Source
from tolalloc.drawings.table_file import DATA
from tolalloc.drawings.tolerance_table import load_tolerance_table
from tolalloc.drawings.zones import Feature
from tolalloc.exceptions import TolallocError
from tolalloc.models.function_model import FunctionModel
from tolalloc.models.model import Evaluation
from tolalloc.models.settings import Setting
from tolalloc.reading.units import MILLIMETRE
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.outputs import Orders
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.files import PRESETS
from tolalloc.reducers.response.kernel import KernelResponse
from tolalloc.reports.document import Section
from tolalloc.reports.wording import Spoken, number
from tolalloc.study.prepared import Prepared

LINEAR_STAGE = Path(__file__).with_name("cd29_linear.reducer.toml")
"""A single stage of linear contact with wide holes, which closed forms hold for."""


def prepared(
    *,
    reducer: dict[str, Any] | None = None,
    drawing: dict[str, Any] | None = None,
    limits: dict[str, ta.Limit] | None = None,
    **changes: Any,
) -> Prepared:
    """Return the study of the baseline, with fields changed; nothing is solved.

    Parameters
    ----------
    reducer, drawing
        Fields of ``ta.reducer`` and ``ta.drawing`` that differ from the baseline.
    limits
        Limits of the study; 60″ for the peak-to-peak unless given.
    changes
        Other fields of ``ta.Study``.
    """
    chosen = {
        "name": "rv20e_liu2020",
        "flank_clearance": (1.0, 5.0),
        "radial_clearance": (5.0, 20.0),
        **(reducer or {}),
    }
    study = ta.Study(
        model=ta.reducer(**chosen),
        drawing=ta.drawing(**{"table": "rv20e_table4", **(drawing or {})}),
        limits={ta.PEAK_TO_PEAK: ta.Limit(upper=60.0)} if limits is None else limits,
        **{"name": "test", **changes},
    )
    return Prepared(study=study)


def verifier_of(
    prepared: Prepared, *others: Requirement, limit: float = 60.0, space: DesignSpace | None = None, **changes: Any
) -> Verifier:
    """Return what verifies designs of a prepared study on 1152 units, its first requirement at another limit."""
    first = replace(prepared.requirements[0], limits=Limits(upper=limit))
    fields = {"seeds": SeedTree(4), "units": 1152, **changes}
    return Verifier(space=space or prepared.space, model=prepared.model, requirements=(first, *others), **fields)


def baseline_errors(*names: str) -> ErrorModel:
    """Return the sources of the shipped baseline table, or these of them, as the columns that they move."""
    table = {own.name: own for own in load_tolerance_table("rv20e_table4")}
    return ErrorModel(tuple(table[name] for name in names or table))


def source(name: str, feature: Feature = Feature.SIZE, zone: float = 6.0, **changes: Any) -> Source:
    """Return a source with a zone of six standard deviations of 1, which may become a tenth or ten times as wide."""
    own = {"part": "part", "minimum": zone / 10, "maximum": 10 * zone, "cost": 1.0, **changes}
    return Source(name=name, feature=feature, zone=zone, **own)


def sizes(names: Iterable[str], correlation: Correlation | None = None, **changes: Any) -> ErrorModel:
    """Return independent sizes of standard deviation 1 by these names, unless fields are changed."""
    return ErrorModel(tuple(source(name, **changes) for name in names), correlation=correlation or Correlation())


ZONE_OF_A_LENGTH = {"plus": 20.0, "minus": -20.0, "unit": "µm", "min": 5.0, "max": 100.0, "cost": 1.0}


def summed(a: float, b: float, c: float) -> float:
    """Return the length of three parts."""
    return a + b + c


def study_of_lengths(drawing: ta.Drawing, **changes: Any) -> ta.Study:
    """Return the study of the length of three parts within ± 0.03 mm, with fields changed."""
    own = {"questions": [ta.Allocation(front=False, what_if=False)], "effort": "quick", **changes}
    model = ta.model(summed, inputs=dict.fromkeys("abc", 0.0), outputs=("length [mm]",))
    return ta.Study(model, drawing, limits={"length [mm]": ta.Limit(lower=-0.03, upper=0.03)}, **own)


def measured_size(parts: int) -> ErrorModel:
    """Return one size whose measured parts have mean 0 and σ = 1 [m]; half its zone is 3σ."""
    stated = StatedProcess(mean=0.0, deviation=1.0, parts=parts)
    made = MeasuredParts(path=Path("parts.csv"), values=(), are_radii=False, zone=6.0, middle=0.0, stated=stated)
    return ErrorModel((source("x1", distribution=Distribution.EMPIRICAL, measured=made),))


def verifier_of_sum(*zones: float, limit: float, guarantee: Guarantee | None = None) -> Verifier:
    """Return what verifies designs of y = Σ xᵢ ≤ limit, xᵢ normal of σᵢ = zoneᵢ/6 [mm].

    Every zone costs 1, in proportion to 1/zone. Unless another guarantee is given, √(Σ (zoneᵢ/2)²) must keep the limit.
    """
    names = tuple(f"x{at}" for at in range(1, len(zones) + 1))
    errors = ErrorModel(
        tuple(source(name, zone=zone * MILLIMETRE, group=name) for name, zone in zip(names, zones, strict=True))
    )
    model = FunctionModel(function=lambda *x: sum(x), inputs=names, outputs=("y [mm]",)).bound(errors, "")
    shown = Requirement(output="y [mm]", limits=Limits(upper=limit), guarantee=guarantee or RootSumSquare())
    space = DesignSpace(errors=errors)
    return Verifier(space=space, model=model, requirements=(shown,), seeds=SeedTree(1), units=2000)


def verifier_with_setting(lower: float, upper: float, present: float) -> Verifier:
    """Return what verifies designs of y = x + 0.2·setting ≤ 5, x normal of 1 [mm]."""
    setting = Setting(name="setting [mm]", value=present, lower=lower, upper=upper, step=0.1)
    errors = ErrorModel((source("x", zone=6 * MILLIMETRE),))
    made = FunctionModel(
        function=lambda x, at: x + 0.2 * at, inputs=("x",), outputs=("y [mm]",), settings=(setting,)
    ).bound(errors, "")
    shown = Requirement(output="y [mm]", limits=Limits(upper=5.0), guarantee=AtYield(0.9973))
    space = DesignSpace(errors=errors, settings=(setting,))
    return Verifier(space=space, model=made, requirements=(shown,), seeds=SeedTree(1), units=2000)


@dataclass(frozen=True)
class Sum:
    """A model whose only output is the sum of its columns."""

    columns: tuple[str, ...]
    outputs: tuple[str, ...] = ("y [-]",)

    def __call__(self, x: np.ndarray) -> Evaluation:
        return Evaluation(values=x.sum(axis=1, keepdims=True), status=np.zeros(x.shape[0], np.uint8))


def written(path: Path, content: str | bytes, encoding: str = "utf-8") -> Path:
    """Write a file byte by byte and return its path."""
    path.write_bytes(content if isinstance(content, bytes) else content.encode(encoding))
    return path


def page_of(folder: Path) -> str:
    """Return the page of the report in a folder."""
    return (folder / "report.html").read_text(encoding="utf-8")


def summary_of(folder: Path) -> dict[str, Any]:
    """Return what the report in a folder says for programs."""
    found = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    assert isinstance(found, dict)
    return found


def refusal(read: Callable[[Path], object], path: Path) -> str:
    """Return the one sentence in which a file is refused."""
    with pytest.raises(TolallocError) as caught:
        read(path)
    sentence = str(caught.value)
    assert "\n" not in sentence
    return sentence


def says(prose: str | Iterable[str], sentence: str, **gaps: object) -> bool:
    """Return whether prose holds a sentence of a teller, whatever its words are.

    Parameters
    ----------
    prose
        One text or several.
    sentence
        Teller and key, such as ``simulation.ringing``.
    gaps
        What fills some of its gaps; the others may hold anything.
    """
    pattern = ""
    for words, gap, form, _ in Formatter().parse(_with_gaps(sentence)):
        pattern += re.escape(words)
        if gap is not None:
            pattern += re.escape(number(gaps[gap], form or "")) if gap in gaps else ".*"
    return any(re.search(pattern, own) for own in ([prose] if isinstance(prose, str) else prose))


def wording(sentence: str, **gaps: object) -> str:
    """Return a sentence of a teller, such as ``simulation.ringing``, with all of its gaps filled."""
    return Spoken().format(_with_gaps(sentence), **gaps)


def _with_gaps(sentence: str) -> str:
    """Return the words of a sentence of a teller, its gaps open."""
    teller, key = sentence.split(".")
    (path,) = PACKAGE.rglob(f"sentences/{teller}.toml")
    return " ".join(tomllib.loads(path.read_text(encoding="utf-8"))[key].split())


def telling(sentences: Iterable[str], sentence: str, **gaps: object) -> str:
    """Return the one of several sentences that says a sentence of a teller."""
    (found,) = (own for own in sentences if says(own, sentence, **gaps))
    return found


def headed(sections: Iterable[Section], heading: str, **gaps: object) -> Section:
    """Return the one section whose heading is a sentence of a teller."""
    (found,) = (own for own in sections if says(own.heading, heading, **gaps))
    return found


FEW = ("housing.pitch", "housing.runout", "disc1.pitch", "disc2.pitch", "pin.diameter")
"""Sources of the baseline that a small study varies."""
FIRST_STAGE = ("sun.", "planet", "mesh")
STANDING = ("housing.", "each_pin.", "carrier.assembly", "carrier.tilt", "sun.assembly")
"""What stands still in the housing; a source that begins like none of these turns with the sun, a disc or the carrier.
The pins' common diameter and the common radius of their grooves are the same all round and count as neither."""


def table_of_three_cranks(name: str, pins: int = 40) -> dict[str, Source]:
    """Return the sources of a shipped table by name; those of the third crank are like the first one's."""
    found = {source.name: source for source in load_tolerance_table(name, "generic")}
    for source in tuple(found.values()):
        if source.each > 1:
            found[source.name] = replace(source, each=pins if source.name.startswith("each_pin.") else pins - 1)
        for first in ("bore1", "crank1", "planet1", "mesh1"):
            if first in source.name:
                third = source.name.replace(first, first[:-1] + "3")
                found[third] = replace(source, name=third)
    return found


def deviations_at(errors: ErrorModel, uniform: np.ndarray, scale: float = 1.0) -> np.ndarray:
    """Return the units that uniform numbers stand for, a column for each of the errors, all zones scaled alike."""
    return errors.deviations(errors.standard_values(uniform), scale * errors.zones)


def seeded_units(errors: ErrorModel, count: int, seeds: int | SeedTree = 1, scale: float = 1.0) -> np.ndarray:
    """Return the units that an experiment with these seeds draws, a column for each of the errors."""
    tree = SeedTree(seeds) if isinstance(seeds, int) else seeds
    uniform = np.concatenate(list(tree.uniform_chunks(count, len(errors.columns))))
    return deviations_at(errors, uniform, scale)


def units_at_random(errors: ErrorModel, count: int, seed: int = 1, scale: float = 1.0) -> np.ndarray:
    """Return units of random numbers that no experiment draws, a column for each of the errors."""
    return deviations_at(errors, np.random.default_rng(seed).random((count, len(errors.columns))), scale)


def drawn_units(errors: ErrorModel, model: EquivalentModel, units: int, scale: float = 1.0) -> np.ndarray:
    """Return the columns of random units at the reducer's modification, all zones scaled alike [m, angles rad]."""
    found = np.zeros((units, len(model.columns)))
    at = [model.columns.index(name) for name in errors.columns]
    found[:, at] = units_at_random(errors, units, 20260101, scale)
    for name, amount in model.reducer.modification.deviations.items():
        found[:, model.columns.index(name)] = amount
    return found


def only(units: np.ndarray, model: EquivalentModel, *beginnings: str, without: bool = False) -> np.ndarray:
    """Return the units with the errors alone whose names begin like these, or without them; the modification stays."""
    chosen = np.array([name.startswith(beginnings) is not without for name in model.columns])
    modification = np.array([name.startswith("modification.") for name in model.columns])
    return np.asarray(np.where(chosen | modification, units, 0.0))


def unit_with(model: EquivalentModel, **errors: float) -> np.ndarray:
    """Return one unit with the reducer's modification and these errors; ``__`` stands for a point in a name."""
    known = model.reducer.modification.deviations | {name.replace("__", "."): own for name, own in errors.items()}
    assert known.keys() <= set(model.columns)
    return np.array([[known.get(name, 0.0) for name in model.columns]])


def order_spectrum(transmission_error: np.ndarray) -> Orders:
    """Return Fourier's sum of curves on equally spaced angles of one turn, orders below half the number of angles."""
    angles = transmission_error.shape[1]
    order = np.arange(1.0, (angles + 1) // 2)
    found = np.fft.rfft(transmission_error, axis=1)[:, 1 : order.size + 1] * (2 / angles)
    return Orders(order=order, amplitude=np.abs(found), phase=np.angle(found), angles=angles)


def kernel_of(model: EquivalentModel, errors: ErrorModel, torque: float) -> KernelResponse:
    """Return the model at a torque as a function of the errors alone, its modification as designed, the rest 0."""
    still = dict.fromkeys(model.columns, 0.0) | model.reducer.modification.deviations
    fixed = {name: value for name, value in still.items() if name not in errors.columns}
    return KernelResponse(model=model, torque=torque, columns=errors.columns, fixed=fixed)


def at_constant_contact(reducer: Reducer) -> Reducer:
    """Return a reducer whose pin contacts are springs of one stiffness at every force."""
    return replace(reducer, stiffness=replace(reducer.stiffness, pin_contact_law="constant"))


def reducer_file(path: Path, preset: str, *changes: tuple[str, str], added: str = "") -> Path:
    """Write the file of a shipped reducer with texts changed, each of which stands in it once, and return its path."""
    text = (PRESETS / f"{preset}.reducer.toml").read_text(encoding="utf-8")
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    path.write_text(text + added, encoding="utf-8")
    return path


SHOP = "process,tolerance [unit],unit,cost [cost units]\n"


def shop_file(path: Path) -> Path:
    """Write what a shop asks for a process at five zones t in µm, 0.5 + 40/t, and return the file's path."""
    return written(path, SHOP + "".join(f"ground,{zone},µm,{0.5 + 40 / zone}\n" for zone in (5, 8, 12, 20, 40)))


def few_sources(folder: Path, *names: str, **columns: str) -> Path:
    """Write the baseline's table with some sources alone, five unless named, with columns changed; return its path."""
    table = pd.read_csv(DATA / "rv20e_table4.tolerances.csv", dtype=str, keep_default_na=False)
    table[table["id"].isin(names or FEW)].assign(**columns).to_csv(folder / "few.csv", index=False)
    return folder / "few.csv"


def numbers_of(answer: object) -> list[float]:
    """Return every number of an answer for programs, in its order."""
    inner = answer.values() if isinstance(answer, dict) else answer if isinstance(answer, list) else ()
    return [answer] if isinstance(answer, int | float) else [number for one in inner for number in numbers_of(one)]


def with_ovality(drawing: Drawing, amplitude: float) -> Drawing:
    """Return a drawing whose ring is oval by an amplitude [m]."""
    errors = drawing.errors
    sources = tuple(
        replace(own, systematic=((2, amplitude, 0.0),)) if own.name == "housing.runout" else own
        for own in errors.sources
    )
    return drawing.with_sources(sources)

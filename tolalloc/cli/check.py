"""The command ``tolalloc check``: what a study reads, before anything long runs."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tolalloc.cli.console import AsJson, announce_kernel, print_json
from tolalloc.cli.run import Script
from tolalloc.cli.study_script import load_study
from tolalloc.reading.units import MICROMETRE

if TYPE_CHECKING:
    from pathlib import Path

    import numpy as np
    from jaxtyping import Float

    from tolalloc.drawings.sources import Source
    from tolalloc.study.prepared import Prepared


Timed = Annotated[
    bool, typer.Option("--time", help="Solve a few units and say about how long each question takes here.")
]


def check(script: Script, timed: Timed = False, as_json: AsJson = False) -> None:
    """Check a study's names, units and bounds; no question is asked, but the script, a program, is run."""
    from tolalloc.study.prepared import Prepared

    study = load_study(script)
    if any(question.reads for question in study.questions):
        prepared = Prepared(study=study)
        summary, lines, verdict = _checked(prepared, script, [question.kind for question in study.questions])
        if timed:
            found, said = _timed(prepared)
            summary, lines = {**summary, **found}, [*lines, *said]
    else:
        kinds = ", ".join(question.kind for question in study.questions)
        summary = {"study": study.name, "questions": kinds}
        lines, verdict = [], f"Study {study.name} is in order; it asks: {kinds}."
    if as_json:
        print_json(summary)
    else:
        lines += [f"A study is a Python program: {script} was run to read it.", verdict]
        typer.echo("\n".join(lines))  # in one piece: a check that is stopped says nothing rather than half


def _checked(prepared: Prepared, script: Path, kinds: list[str]) -> tuple[dict[str, Any], list[str], str]:
    """Return what a check found, for a program and in lines for a person, and the sentence that sums it up."""
    from tolalloc.drawings.tolerance_table import doubts
    from tolalloc.reading.units import COST_UNITS
    from tolalloc.reports.portrait import portrait_of

    study, model = prepared.study, prepared.model
    errors, requirements, space = prepared.errors, prepared.requirements, prepared.space
    portrait = portrait_of(model)
    summary = {
        "study": study.name,
        "model": model.name,
        "sources": len(errors.sources),
        "varying": len(errors.active),
        "groups": list(space.groups),
        "limits": {own.output: [own.limits.lower, own.limits.upper] for own in requirements},
        "questions": kinds,
    }
    lines = [
        f"{script}: study {study.name}.",
        f"{model.name}: {len(errors.active)} of {len(errors.sources)} sources vary, in {len(space.groups)} groups; "
        f"it asks: {', '.join(kinds)}.",
        *(f"  limit: {requirement.sentence}" for requirement in requirements),
    ]
    lines += _zones(errors.active)
    lines += [f"  {sentence}" for sentence in errors.correlation.mappings(errors.sources)]
    lines += [f"  {setting.sentence}" for setting in model.settings]
    if "allocation" in kinds:
        cost = float(space.cost(space.uniform(1.0)))
        locked = f", those that are locked {space.locked_cost:.2f} of it" if space.locked_cost else ""
        lines.append(f"The zones of the table cost {cost:.2f} {prepared.currency or COST_UNITS}{locked}.")
        summary |= {"cost of the tolerance table [cost units]": cost}
    neglected = [source.name for source in errors.sources if source.zone == 0.0]
    if neglected:
        kinds_of = dict.fromkeys(map(_without_numbers, neglected))
        share = f"{len(neglected)} of {len(errors.sources)} rows"
        lines.append(f"Neglected, with a zone of 0: {', '.join(kinds_of)} ({share}).")
    lines += [f"Neglected: {sentence}." for sentence in portrait.left_out]
    examined = portrait.examination(model.examined(_random_units(prepared)))
    lines += study.drawing.notes if study.drawing else ()
    summary |= {"neglected": [*neglected, *portrait.left_out]}
    summary |= {"examined": list(examined.sentences), "but": examined.but}
    doubted = len(doubts(errors.sources, errors.table))
    said = f"{doubted} of its rows {'is' if doubted == 1 else 'are'} doubted above" if doubted else ""
    but = "; ".join(own for own in (said, examined.but) if own)
    state = "can be run" if examined.fault else "is in order"
    verdict = f"Study {study.name} {state}{f', but {but}' if but else ''}."
    summary |= {"doubted rows": doubted}
    return summary, [*lines, *examined.sentences], verdict


def _zones(sources: tuple[Source, ...]) -> list[str]:
    """Return a line for every source, or one for all whose names differ by their numbers alone, if they are alike."""
    said: dict[str, dict[str, str]] = {}
    for source in sources:
        name = f"{source.own_id} ({source.name})" if source.own_id else source.name
        span = f"may become {source.minimum / MICROMETRE:.3g}…{source.maximum / MICROMETRE:.3g} µm"
        mapping = f"{source.mapping}; {'locked' if source.locked else span}"
        said.setdefault(_without_numbers(name), {})[name] = mapping
    lines = []
    for pattern, own in said.items():
        alike = len(own) > 1 and len({*own.values()}) == 1
        together = {f"{pattern} ({len(own)} rows, each)": next(iter(own.values()))} if alike else own
        lines += [f"  {name}: {mapping}" for name, mapping in together.items()]
    return lines


def _without_numbers(name: str) -> str:
    """Return the name of a source with a star for every number."""
    return re.sub(r"\d+", "*", name)


def _timed(prepared: Prepared) -> tuple[dict[str, Any], list[str]]:
    """Return about how long the questions take at their effort and at the quick one, likewise."""
    from dataclasses import replace

    from tolalloc.study.duration import durations

    study = prepared.study
    announce_kernel(study.model)
    efforts = {"quick": study.with_effort("quick"), **({} if study.quick else {"full": study})}
    summary, lines = {}, []
    for effort, asked in efforts.items():
        for own in durations(replace(prepared, study=asked)):
            summary[f"{effort} {own.kind}"] = {"units": list(own.units), "seconds": list(own.seconds)}
            lines.append(f"{'With --quick, ' if effort == 'quick' else ''}{own.sentence}")
    return {"durations": summary}, lines


_CHECKED = 1000
"""Random units that a check solves [-]."""


def _random_units(prepared: Prepared) -> Float[np.ndarray, "unit column"]:
    """Return the deviations of random units at the zones of the drawing."""
    import numpy as np

    from tolalloc.drawings.seeds import SeedTree

    errors, seeds = prepared.errors, SeedTree(prepared.study.seed).child("check")
    chunks = seeds.uniform_chunks(_CHECKED, len(errors.columns))
    return np.concatenate([errors.deviations(errors.standard_values(uniform), errors.zones) for uniform in chunks])

"""What a duty cycle does to a reducer: lives of bearings, loads and losses of its load cases, temperature."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

from tolalloc.reading.units import ARCMINUTE
from tolalloc.reducers.equivalent.resonance import orders_of
from tolalloc.reports.columns import Column, Table
from tolalloc.reports.document import Section
from tolalloc.reports.figure import Figure, Series
from tolalloc.reports.portraits.reducer import resonance_sentence
from tolalloc.reports.teller import Teller
from tolalloc.reports.templates import Sentences
from tolalloc.wings.motion.duty import MAIN, BearingLife, CaseLoads, DutyResult

if TYPE_CHECKING:
    import pandas as pd

_say = Sentences("duty", "tolalloc.wings.motion")


def _called(kind: str) -> str:
    """Return the name of a kind of bearing."""
    return kind.replace("_", " ").replace("crank ", "crank–").replace("carrier bearing", "main bearing", kind == MAIN)


_BEARINGS: tuple[Column[BearingLife], ...] = (
    Column("bearing", lambda own: _called(own.kind), terminal=True),
    Column("number [-]", lambda own: own.count),
    Column("load rating C [N]", lambda own: round(own.load_rating), terminal=True),
    Column("equivalent load [N]", lambda own: round(own.load), terminal=True),
    Column("turns per turn of the output [-]", lambda own: own.turns),
    Column("life L10 [h]", lambda own: round(own.life), terminal=True),
)
_CASES: tuple[Column[CaseLoads], ...] = (
    Column("load case", lambda own: own.case.name, terminal=True),
    Column("torque [N·m]", lambda own: own.case.torque, terminal=True),
    Column("speed [rpm]", lambda own: own.case.speed, terminal=True),
    Column("share of the time [%]", lambda own: 100.0 * own.share),
    Column("external moment [N·m]", lambda own: own.case.moment or "", nothing=""),
    Column("discs above the ring [K]", lambda own: own.disc_temperature),
    Column("largest pin force [N]", lambda own: own.pin_force),
    Column("largest line load [N/mm]", lambda own: own.line_load),
    Column("peak pressure [MPa]", lambda own: own.pressure, terminal=True),
    Column("friction torque at the output [N·m]", lambda own: own.friction_torque),
    Column("overall efficiency [%]", lambda own: 100.0 * own.efficiency, terminal=True),
    Column("lost power [W]", lambda own: own.loss, terminal=True),
)


class DutyTeller(Teller[DutyResult]):
    """What is said of one duty cycle."""

    @property
    def title(self) -> str:
        """What the answer is about."""
        return _say("title", model=self.header.model)

    @property
    def subtitle(self) -> str:
        """Mean torque and speed."""
        return _say("subtitle", count=len(self.result.loads), duty=self.result)

    @property
    def sentences(self) -> tuple[str, ...]:
        """Life, pressure, heat, tilt and resonance."""
        result = self.result
        pressed = max(result.loads, key=lambda own: own.pressure)
        said = [
            *self._life,
            _say("pressure", loads=pressed),
            _say("heat", duty=result, temperature=result.temperatures[-1], steps=len(result.temperatures) - 1),
        ]
        if result.tilt is not None:
            moment = max(abs(own.case.moment) for own in result.loads)
            said.append(_say("tilt", moment=moment, tilt=result.tilt / ARCMINUTE))
        return (*said, *self._resonance)

    @property
    def _resonance(self) -> tuple[str, ...]:
        """Which orders meet the resonance of the load up to the fastest load case, under the largest torque."""
        reducer, cases = self.result.reducer, [own.case for own in self.result.loads]
        torque = max((own.torque or 0.0 for own in cases), key=abs) or reducer.load.rated_torque
        fastest = abs(reducer.ratio) * max(own.speed or 0.0 for own in cases)
        said = resonance_sentence(reducer, torque, orders_of(reducer), fastest)
        return (said,) if said else ()

    @property
    def _life(self) -> tuple[str, ...]:
        result = self.result
        if result.life is None:
            return (_say("no_life", life=result.catalogue_life),)
        least = min(result.bearings, key=lambda own: own.life)
        share, at = max((share, at) for at, share in enumerate(least.shares))
        worst = {"share": share, "worst": result.loads[at].case.name}
        said = _say("life", life=result.life, kind=_called(least.kind), least=least.life, **worst)
        return said, _say("catalogue", life=result.catalogue_life)

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What lives, heat and moment take for granted, beside the reducer's own."""
        own = [_say("assume_life")] * bool(self.result.bearings)
        own += [_say("assume_catalogue"), _say("assume_heat", resistance=self.result.resistance), _say("assume_idle")]
        own += [_say("assume_moment")] * (self.result.tilt is not None)
        return (*own, *self.header.assumptions)

    @cached_property
    def sections(self) -> tuple[Section, ...]:
        """Bearings, load cases and where the heat comes from."""
        bearings, cases = ((own.name, own.frame()) for own in (self._bearings, self._cases))
        life = Section(heading=_say("life_heading"), figures=(self._damage,), tables=(bearings,))
        return (
            *((life,) if self.result.bearings else ()),
            Section(heading=_say("case_heading"), tables=(cases,)),
            Section(heading=_say("heat_heading"), figures=(self._heat,)),
        )

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Lives, load cases and temperature, units of measurement in the names."""
        result = self.result
        return {
            "reducer": self.header.model,
            "mean torque [N·m]": result.mean_torque,
            "mean speed [rpm]": result.mean_speed,
            "life of all bearings L10 [h]": result.life,
            "life by the makers' formula [h]": result.catalogue_life,
            "mean lost power [W]": result.mean_loss,
            "discs above the ring [K]": result.temperatures[-1],
            "thermal resistance [K/W]": result.resistance,
            "tilt of the output [arcmin]": None if result.tilt is None else result.tilt / ARCMINUTE,
            self._bearings.name: self._bearings.records(),
            self._cases.name: self._cases.records(),
            "assumptions": list(self.assumptions),
        }

    @property
    def terminal(self) -> tuple[tuple[pd.DataFrame, str], ...]:
        """Load cases, and the bearings that are known."""
        model, cases = self.header.model, (self._cases.terminal(), _say("cases_on_terminal", model=self.header.model))
        if not self.result.bearings:
            return (cases,)
        return ((self._bearings.terminal(), _say("bearings_on_terminal", model=model)), cases)

    @cached_property
    def _bearings(self) -> Table[BearingLife]:
        return Table(name="bearings", columns=_BEARINGS, rows=self.result.bearings)

    @cached_property
    def _cases(self) -> Table[CaseLoads]:
        return Table(name="load cases", columns=_CASES, rows=self.result.loads)

    @property
    def _damage(self) -> Figure:
        """Share of each bearing's life that every load case uses up."""
        cases = [own.case.name for own in self.result.loads]
        bars = (
            Series.bars(_called(own.kind), cases, [100.0 * share for share in own.shares])
            for own in self.result.bearings
        )
        return Figure("damage", _say("damage_figure"), "share of the life [%]", series=tuple(bars))

    @property
    def _heat(self) -> Figure:
        """Part of the mean lost power that comes from each load case."""
        cases = [own.case.name for own in self.result.loads]
        heat = Series.bars("lost power", cases, [own.share * own.loss for own in self.result.loads])
        return Figure("heat", _say("heat_figure"), "part of the mean lost power [W]", series=(heat,))

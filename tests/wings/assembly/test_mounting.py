"""Measured parts in their places: against exact geometry, against symmetries, and against all mountings there are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from studies.benchmarks.plain_rows import dense_rows
from tests.builders import baseline_errors, kernel_of, seeded_units, written
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError, SolveError, TolallocError, UnknownNameError
from tolalloc.models.model import Evaluation
from tolalloc.reading.units import ARCSECOND, MICROMETRE
from tolalloc.reducers.equivalent.interfaces import crank_disc
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.springs import Positions
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reducers.response.kernel import KernelResponse
from tolalloc.wings.assembly.mounting import best_mounting, random_mounting, units_from
from tolalloc.wings.assembly.places import (
    MountingPlace,
    PartTurn,
    carrier_turn,
    disc_turns,
    housing_turn,
    mounted,
    own_name,
    owned_columns,
    places_of,
    sun_turn,
    unmounted,
)
from tolalloc.wings.assembly.stock import MeasuredPart, PartStock, drawn_parts, load_parts, own_errors
from tolalloc.wings.bench.sources import half_turn

TORQUE = -1.0
ROUNDING = 1e-9  # arcsec


@pytest.fixture(scope="module")
def errors() -> ErrorModel:
    return baseline_errors()


@pytest.fixture(scope="module")
def kernel(rv20e: EquivalentModel, errors: ErrorModel) -> KernelResponse:
    return kernel_of(rv20e, errors, TORQUE)


def place(reducer: Reducer, name: str) -> MountingPlace:
    return next(place for place in places_of(reducer) if place.name == name)


def random_part(columns: tuple[str, ...], at: MountingPlace, generator: np.random.Generator) -> dict[str, float]:
    """Errors of all kinds that a part at a place can have, lengths and angles in its own frame."""
    names = [name for column in columns if (name := own_name(column, at)) is not None]
    return {name: (1e-5 if "tilt" in name else 1e-6) * generator.normal() for name in names}


def stock_of(errors: ErrorModel, reducer: Reducer, units: int, seed: int) -> PartStock:
    parts = drawn_parts(errors, reducer, units, SeedTree(seed))
    return PartStock(reducer=reducer, parts=parts, columns=errors.columns)


def fits(reducer: Reducer, disc: int, bores: int) -> bool:
    """Whether a disc made for place 1, turned by bores at another place, touches every pin: distances to its path."""
    stage, around = reducer.cycloid_stage, np.linspace(0, 2 * np.pi, 100_000, endpoint=False)
    path = stage.pin_circle_radius * np.exp(1j * around) - stage.eccentricity * np.exp(1j * stage.pin_count * around)
    carrier_angle = 0.3
    direction = -stage.disc_teeth * carrier_angle + 2 * np.pi * disc / reducer.disc_count
    pins = stage.pin_circle_radius * np.exp(2j * np.pi * np.arange(3) / stage.pin_count)
    turned = carrier_angle + 2 * np.pi * bores / reducer.crank_count
    seen = (pins - stage.eccentricity * np.exp(1j * direction)) * np.exp(-1j * turned)
    return bool(np.abs(path - seen[:, np.newaxis]).min(axis=1).max() < 1e-5)


@pytest.mark.parametrize(
    ("cranks", "discs", "teeth"), [(2, 2, 39), (3, 2, 39), (2, 3, 39), (3, 3, 40), (2, 2, 40), (4, 2, 41)]
)
def test_discs_fit_where_their_teeth_meet_all_pins(cranks: int, discs: int, teeth: int) -> None:
    base = load_reducer("rv20e_liu2020")
    stage = replace(base.cycloid_stage, disc_teeth=teeth, pin_count=teeth + 1)
    reducer = replace(base, crank_count=cranks, disc_count=discs, cycloid_stage=stage)
    for disc in range(discs):
        expected = [bores for bores in range(cranks) if fits(reducer, disc, bores)]
        assert [turn.number for turn in disc_turns(reducer, 0, disc)] == expected


def test_discs_of_an_rv20e_are_alike_and_the_second_stands_turned_by_half_a_turn() -> None:
    reducer = load_reducer("rv20e_liu2020")
    places = {place.name: place for place in places_of(reducer)}
    assert [turn.number for turn in places["disc1"].turns] == [0]
    assert [(turn.number, turn.ring.by) for turn in places["disc2"].turns] == [(1, 20)]
    assert places["disc1"].kind == places["disc2"].kind == "disc"
    assert [place.kind for place in places_of(load_reducer("rv80e")) if "disc" in place.name] == ["disc1", "disc2"]


def test_planets_that_meet_the_sun_unlike_keep_their_cranks_in_place() -> None:
    def kinds(name: str) -> list[str]:
        return [place.kind for place in places_of(load_reducer(name)) if place.name.startswith("crank")]

    assert kinds("rv20e_liu2020") == ["crank"] * 2
    assert kinds("rv40e_xi2015") == ["crank1", "crank2"]  # (21 + 42)/2 is not whole
    assert kinds("rv80e") == ["crank"] * 3


@pytest.mark.parametrize("name", ["rv20e_liu2020", "rv80e"])
def test_every_column_but_the_modification_belongs_to_one_place(name: str) -> None:
    reducer = load_reducer(name)
    for column in EquivalentModel(reducer).columns:
        owners = [place.name for place in places_of(reducer) if own_name(column, place) is not None]
        assert len(owners) == (0 if column.startswith("modification.") else 1), column


def test_a_disc_at_place_2_has_the_gaps_of_the_same_disc_turned_in_space(
    rv20e: EquivalentModel, generator: np.random.Generator
) -> None:
    reducer, stage, at = rv20e.reducer, rv20e.reducer.cycloid_stage, place(rv20e.reducer, "disc2")
    own = random_part(rv20e.columns, at, generator)
    carrier_angle = generator.uniform(0, 2 * np.pi, 5)
    group = dense_rows(Positions(reducer, carrier_angle))
    columns = mounted(own, at, at.turns[0])
    vector = np.array([columns.get(name, 0.0) for name in group.columns])
    found = (group.error @ vector).reshape(5, 2, stage.pin_count)[:, 1]
    # The disc itself: half a turn on in its carrier, its centre across from disc 1's.
    direction = -stage.disc_teeth * carrier_angle[:, np.newaxis] + np.pi
    pin = 2 * np.pi * np.arange(stage.pin_count) / stage.pin_count
    pole = stage.pin_count * stage.eccentricity * np.exp(1j * direction)
    centre = stage.pin_circle_radius * np.exp(1j * pin)
    normal = (pole - centre) / np.abs(pole - centre)
    arm = centre + stage.pin_radius * normal - stage.eccentricity * np.exp(1j * direction)
    on_disc = np.angle(arm * np.exp(-1j * (carrier_angle[:, np.newaxis] + np.pi)))
    tooth = np.floor(on_disc * stage.disc_teeth / (2 * np.pi)).astype(int) % stage.disc_teeth
    gap = np.zeros(on_disc.shape)
    for kind, along in (("runout", arm / np.abs(arm)), ("pitch", 1j * arm / np.abs(arm))):
        deviation = np.array([own[f"each_tooth.{kind}.{number + 1}"] for number in range(stage.disc_teeth)])[tooth]
        for order in rv20e.orders:
            deviation = deviation + own[f"{kind}.cos{order}"] * np.cos(order * on_disc)
            deviation = deviation + own[f"{kind}.sin{order}"] * np.sin(order * on_disc)
        gap += deviation * (normal * along.conj()).real
    assert np.abs(gap).max() > 1e-7
    assert np.abs(found + gap).max() < 1e-15


def test_bores_of_a_disc_at_place_2_lie_where_the_turned_disc_has_them(
    rv20e: EquivalentModel, generator: np.random.Generator
) -> None:
    reducer, at = rv20e.reducer, place(rv20e.reducer, "disc2")
    own = {name: value for name, value in random_part(rv20e.columns, at, generator).items() if "position" in name}
    carrier_angle = generator.uniform(0, 2 * np.pi, 5)
    group = crank_disc(Positions(reducer, carrier_angle))
    columns = mounted(own, at, at.turns[0])
    vector = np.array([columns.get(name, 0.0) for name in group.columns])
    found = (group.error @ vector).reshape(5, 2, 2, 2)  # angle, disc, crank, axis
    assert not found[:, 0].any()
    for bore, crank in ((1, 2), (2, 1)):  # half a turn on, bore 1 sits on crank 2
        off = (own[f"bore{bore}.position.x"] + 1j * own[f"bore{bore}.position.y"]) * np.exp(
            1j * (carrier_angle + np.pi)
        )
        assert np.abs(found[:, 1, crank - 1] + np.stack([off.real, off.imag], axis=-1)).max() < 1e-18


Mounted = tuple[dict[str, float], MountingPlace, PartTurn]


def unit_of(columns: tuple[str, ...], parts: list[Mounted]) -> np.ndarray:
    total = dict.fromkeys(columns, 0.0)
    for own, at, turn in parts:
        for name, value in mounted(own, at, turn).items():
            total[name] += value
    return np.array([list(total.values())])


def curve(model: EquivalentModel, unit: np.ndarray, angles: int) -> np.ndarray:
    unit = unit.copy()
    for name, value in model.reducer.modification.deviations.items():
        unit[0, model.columns.index(name)] = value
    found = model.equilibria(unit, TORQUE, 2 * np.pi * np.arange(angles) / angles)
    assert not found.status.any()
    return found.transmission_error[0] / ARCSECOND


def test_a_turned_housing_only_moves_the_start_of_the_turn_where_the_sun_moves_on(
    rv20e: EquivalentModel, generator: np.random.Generator
) -> None:
    reducer, pins, angles = rv20e.reducer, 7, 240
    parts = [(random_part(rv20e.columns, at, generator), at, PartTurn()) for at in places_of(reducer)]
    by_name = {at.name: (own, at) for own, at, _ in parts}
    teeth = pins * reducer.first_stage.planet_teeth

    def unit(**turns: PartTurn) -> np.ndarray:
        return unit_of(rv20e.columns, [(own, at, turns.get(name, PartTurn())) for name, (own, at) in by_name.items()])

    before = curve(rv20e, unit(sun=sun_turn(reducer, teeth)), angles)
    after = curve(rv20e, unit(housing=housing_turn(reducer, pins)), angles)
    shift = pins * angles // reducer.cycloid_stage.pin_count
    assert np.abs(after - np.roll(before, shift)).max() < ROUNDING
    assert np.abs(after - np.roll(curve(rv20e, unit(), angles), shift)).max() > 0.01  # the sun's errors count
    pin = mounted({"each_pin.position.3.x": 1.0}, by_name["housing"][1], housing_turn(reducer, pins))
    assert pin == {"each_pin.position.10.x": 1.0}


def test_counting_from_another_of_three_cranks_is_no_other_mounting(generator: np.random.Generator) -> None:
    model = EquivalentModel(load_reducer("rv80e"))
    reducer, angles = model.reducer, 180
    places = {at.name: at for at in places_of(reducer)}
    own = {name: random_part(model.columns, at, generator) for name, at in places.items()}
    first = unit_of(model.columns, [(own[name], at, at.turns[0]) for name, at in places.items()])
    turns = {"carrier": carrier_turn(reducer, 1), "disc1": places["disc1"].turns[1], "disc2": places["disc2"].turns[1]}
    target = {"crank1": "crank2", "crank2": "crank3", "crank3": "crank1"}
    same = unit_of(
        model.columns,
        [(own[name], places[target.get(name, name)], turns.get(name, PartTurn())) for name in places],
    )
    other = unit_of(model.columns, [(own[name], at, turns.get(name, PartTurn())) for name, at in places.items()])
    before = curve(model, first, angles)
    assert np.abs(curve(model, same, angles) - np.roll(before, -angles // 3)).max() < ROUNDING
    assert np.abs(curve(model, other, angles) - np.roll(before, -angles // 3)).max() > 0.01
    assert len(places["carrier"].turns) == 1
    assert len(place(load_reducer("rv20e_liu2020"), "carrier").turns) == 2


def test_a_unit_turned_by_half_a_turn_is_its_parts_turned_and_exchanged(
    rv20e: EquivalentModel, errors: ErrorModel, generator: np.random.Generator
) -> None:
    reducer, columns = rv20e.reducer, errors.columns
    places = {at.name: at for at in places_of(reducer) if at.name != "sun"}
    own = {name: random_part(columns, at, generator) for name, at in places.items()}
    first = unit_of(columns, [(own[name], at, at.turns[0]) for name, at in places.items()])

    def half_turned(crank: dict[str, float]) -> dict[str, float]:  # its journals exchange directions
        return {
            name.replace("journal1", "journal3").replace("journal2", "journal1").replace("journal3", "journal2"): -value
            for name, value in crank.items()
        }

    turned = unit_of(
        columns,
        [
            (own["housing"], places["housing"], housing_turn(reducer, reducer.cycloid_stage.pin_count // 2)),
            (own["carrier"], places["carrier"], carrier_turn(reducer, 1)),
            (half_turned(own["crank1"]), places["crank2"], PartTurn()),
            (half_turned(own["crank2"]), places["crank1"], PartTurn()),
            (own["disc1"], places["disc2"], places["disc2"].turns[0]),
            (own["disc2"], places["disc1"], places["disc1"].turns[0]),
        ],
    )
    assert np.abs(first).max() > 1e-6
    assert np.abs(turned - first @ half_turn(columns, reducer).T).max() < 1e-18


def test_what_is_mounted_can_be_unmounted(rv20e: EquivalentModel, generator: np.random.Generator) -> None:
    for at in places_of(rv20e.reducer):
        own = random_part(rv20e.columns, at, generator)
        for turn in at.turns:
            back = unmounted(mounted(own, at, turn), at, turn)
            assert back.keys() == own.keys()
            assert all(abs(back[name] - own[name]) < 1e-18 for name in own)


def test_drawn_parts_as_they_come_are_the_units_that_were_drawn(errors: ErrorModel, rv20e: EquivalentModel) -> None:
    stock = stock_of(errors, rv20e.reducer, 3, 0)
    assert np.abs(stock.errors(stock.as_they_come) - seeded_units(errors, 3, 0)).max() < 1e-18
    assert stock.units == 3


def test_one_unit_is_mounted_in_the_best_of_all_ways(errors: ErrorModel, kernel: KernelResponse) -> None:
    seen: list[int] = []
    watched = replace(kernel, observe=lambda status: seen.append(status.size))
    stock = stock_of(errors, kernel.model.reducer, 1, 0)
    found, every = best_mounting(stock, watched, SeedTree(0)), random_mounting(stock, kernel, 1, SeedTree(0))
    # Two turns of the carrier, two orders of the cranks and of the discs; a sun without errors may stand anyhow.
    assert found.evaluations == sum(seen) == every.peak_to_peaks.size == 8
    assert every.every
    assert found.after[0] == every.means.min() < np.median(every.means) < every.means.max()
    assert found.before[0] in every.peak_to_peaks
    assert kernel(stock.errors(found.mountings)).values[0, 0] == found.after[0]


def test_the_sun_is_tried_in_all_teeth_only_if_it_has_errors(errors: ErrorModel, rv20e: EquivalentModel) -> None:
    columns = owned_columns(rv20e.columns, places_of(rv20e.reducer))
    parts = drawn_parts(errors, rv20e.reducer, 1, SeedTree(0))
    for value, expected in ((0.0, 8), (1e-6, 80)):
        sun = MeasuredPart(name="sun", kind="sun", errors={"eccentricity.x": value})
        stock = PartStock(reducer=rv20e.reducer, parts=(*parts, sun), columns=columns)
        units = stock.errors(units_from(stock, range(len(stock.parts))))
        assert len(units) == len(np.unique(units, axis=0)) == expected


@pytest.mark.slow
def test_two_units_come_close_to_the_best_of_all_mountings(errors: ErrorModel, kernel: KernelResponse) -> None:
    gaps = []
    for seed in range(3):
        stock = stock_of(errors, kernel.model.reducer, 2, seed)
        units = units_from(stock, range(len(stock.parts)))
        values = kernel(stock.errors(units)).values[:, 0]
        by_parts: dict[frozenset[int], float] = {}
        for parts, value in zip(map(frozenset, units[:, :, 0].tolist()), values.tolist(), strict=True):
            by_parts[parts] = min(value, by_parts.get(parts, np.inf))
        whole = frozenset(range(len(stock.parts)))
        best = min((value + by_parts[whole - parts]) / 2 for parts, value in by_parts.items())
        found = best_mounting(stock, kernel, SeedTree(seed))
        assert len(units) == 1152 and found.evaluations < len(units)
        gaps.append(found.after.mean() / best - 1.0)
    assert min(gaps) > -1e-12  # none is better than the best
    assert max(gaps) < 0.05


@pytest.mark.slow
def test_several_units_gain_more_than_by_chance_and_every_part_is_used_once(
    errors: ErrorModel, kernel: KernelResponse
) -> None:
    stock = stock_of(errors, kernel.model.reducer, 3, 1)
    found, again = (best_mounting(stock, kernel, SeedTree(0), starts=2) for _ in range(2))
    assert np.array_equal(found.mountings, again.mountings)
    assert found.failures == 0
    assert sorted(found.mountings[:, :, 0].ravel()) == list(range(len(stock.parts)))
    assert np.array_equal(kernel(stock.errors(found.mountings)).values[:, 0], found.after)
    chance = random_mounting(stock, kernel, found.evaluations // stock.units, SeedTree(0).child("chance"))
    assert found.after.mean() < chance.means.min() < chance.means.mean() < chance.means.max()


@dataclass(frozen=True)
class Sharp:
    """A response without a machine behind it: largest where columns are, without an answer where a rule says so."""

    columns: tuple[str, ...]
    fails: Callable[[np.ndarray], np.ndarray]
    outputs: tuple[str, ...] = ("peak-to-peak [arcsec]",)

    def __call__(self, x: np.ndarray) -> Evaluation:
        values = np.abs(x @ np.sin(np.arange(1.0, x.shape[1] + 1)))[:, np.newaxis] / MICROMETRE
        failed = self.fails(values[:, 0])
        return Evaluation(values=np.where(failed[:, np.newaxis], 0.0, values), status=failed.astype(np.uint8))


def test_a_unit_without_an_answer_is_never_chosen(errors: ErrorModel, rv20e: EquivalentModel) -> None:
    stock = stock_of(errors, rv20e.reducer, 3, 0)
    response = Sharp(errors.columns, lambda values: values < 2.0)  # what would be best fails, and says 0
    found = best_mounting(stock, response, SeedTree(0), largest_failed_share=1.0)
    assert found.failures > 0
    assert (found.after >= 2.0).all()
    with pytest.raises(SolveError, match=f"{found.failures} of {found.evaluations} units"):
        best_mounting(stock, response, SeedTree(0))
    with pytest.raises(SolveError, match="in any mounting met"):
        nothing = Sharp(errors.columns, lambda values: values < np.inf)
        best_mounting(stock, nothing, SeedTree(0), largest_failed_share=1.0)


HEADER = "part, kind, error, value, unit\n"
ONE_UNIT = (
    "C 1, carrier, bore1.position.x, 3.1, µm\n"
    "K 1, crank, journal1.phase, -12, arcsec\nK 2, crank, planet.eccentricity.y, 4, um\n"
    "D 1, disc, each_tooth.pitch.39, 2, µm\nD 1, disc, tilt.x, 5, arcsec\nD 2, disc, runout.cos4, -1, µm\n"
)


def test_a_parts_file_is_read_in_its_units(tmp_path: Path) -> None:
    reducer = load_reducer("rv20e_liu2020")
    parts = load_parts(written(tmp_path / "parts.csv", HEADER + ONE_UNIT), reducer)
    assert [(part.name, part.kind) for part in parts] == [
        ("C 1", "carrier"),
        ("K 1", "crank"),
        ("K 2", "crank"),
        ("D 1", "disc"),
        ("D 2", "disc"),
    ]
    assert parts[0].errors == {"bore1.position.x": pytest.approx(3.1e-6)}
    assert parts[1].errors == {"journal1.phase": pytest.approx(-12 * ARCSECOND)}
    assert parts[3].errors == {"each_tooth.pitch.39": pytest.approx(2e-6), "tilt.x": pytest.approx(5 * ARCSECOND)}
    assert set(own_errors(reducer)) == {"housing", "carrier", "crank", "disc", "sun"}


@pytest.mark.parametrize(
    ("text", "error", "sentence"),
    [
        ("part,error\nD 1,tilt.x\n", InputError, "columns is 'part, error'"),
        (
            HEADER + ONE_UNIT.replace("C 1, carrier", "C 1, carier"),
            UnknownNameError,
            "kind 'carier'; .* carrier",
        ),
        (HEADER + ONE_UNIT.replace("bore1.position.x", "bore1.positon.x"), UnknownNameError, "bore1.position.x"),
        (HEADER + ONE_UNIT.replace("5, arcsec", "5, µm"), InputError, "unit of tilt.x is 'µm'; allowed is arcsec"),
        (HEADER + ONE_UNIT.replace("3.1, µm", "3.1, mm"), InputError, "is 'mm'; allowed is µm or um"),
        (HEADER + ONE_UNIT.replace("3.1", "three"), InputError, "value of bore1.position.x is 'three'"),
        (HEADER + ONE_UNIT.replace("3.1", "201"), InputError, "from -200 to 200 µm"),
        (HEADER + ONE_UNIT.replace("-12,", "nan,"), InputError, "from -3600 to 3600 arcsec"),
        (HEADER + ONE_UNIT + "D 1, disc, tilt.x, 5, arcsec\n", InputError, "row 8: .*once, and this one stands"),
        (HEADER + ONE_UNIT + "D 1, crank, tilt.x, 5, arcsec\n", InputError, "'crank'; allowed is disc, as further up"),
        (HEADER + ONE_UNIT + ", disc, tilt.x, 5, arcsec\n", InputError, "part is ''; allowed is a name"),
        (HEADER + ONE_UNIT + "D 3, disc, tilt.x, 5, arcsec\n", InputError, "3 disc'; allowed is 1 carrier, 2 crank, 2"),
    ],
)
def test_a_wrong_parts_file_is_refused_in_one_sentence(
    tmp_path: Path, text: str, error: type[TolallocError], sentence: str
) -> None:
    with pytest.raises(error, match=sentence) as raised:
        load_parts(written(tmp_path / "parts.csv", text), load_reducer("rv20e_liu2020"))
    assert str(raised.value).count("\n") == 0
    assert str(tmp_path) in str(raised.value)


def test_parts_of_three_cranks_name_the_place_that_a_disc_is_made_for(tmp_path: Path) -> None:
    reducer = replace(load_reducer("rv20e_liu2020"), name="own", crank_count=3)
    text = HEADER + ONE_UNIT + "K 3, crank, mesh.deviation, 1, µm\n"
    sentence = "row 5: kind is 'disc'; allowed is disc1 or disc2: made for one place of this reducer, a disc fits no"
    with pytest.raises(InputError, match=sentence):
        load_parts(written(tmp_path / "parts.csv", text), reducer)
    text = text.replace("D 1, disc", "D 1, disc1").replace("D 2, disc", "D 2, disc2")
    assert [part.kind for part in load_parts(written(tmp_path / "parts.csv", text), reducer)][-3:] == [
        "disc1",
        "disc2",
        "crank",
    ]


def test_the_example_file_holds_two_units() -> None:
    parts = load_parts(Path("studies/rv20e_two_units.parts.csv"), load_reducer("rv20e_liu2020"))
    assert len(parts) == 12


def test_parts_that_make_no_unit_are_refused(errors: ErrorModel, kernel: KernelResponse) -> None:
    reducer = kernel.model.reducer
    parts = drawn_parts(errors, reducer, 1, SeedTree(0))
    for wrong, sentence in (((), "number of parts is 0"), ((*parts, *parts), "of the name housing of unit 1 is 2")):
        with pytest.raises(InputError, match=sentence):
            PartStock(reducer=reducer, parts=wrong, columns=errors.columns)
    foreign = replace(parts[1], errors={"bore9.position.x": 1e-6})
    with pytest.raises(UnknownNameError, match=r"carrier\.bore"):
        PartStock(reducer=reducer, parts=(parts[0], foreign, *parts[2:]), columns=errors.columns)
    stock = PartStock(reducer=reducer, parts=parts, columns=errors.columns)
    with pytest.raises(InputError, match="number of starts is 0"):
        best_mounting(stock, kernel, SeedTree(0), starts=0)
    with pytest.raises(InputError, match="number of mountings is 0"):
        random_mounting(stock, kernel, 0, SeedTree(0))

"""Worth of a gauge reading before a decision: closed forms, bounds, and the cost of following the advice."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from tests.builders import refusal
from tolalloc.drawings.drawing import load_drawing
from tolalloc.drawings.seeds import SeedTree
from tolalloc.wings.bench.repair import NextReading, Repair, load_repair, repair_costs, worth_of

UNITS = 2**15


def reading(
    costs: np.ndarray, shown: np.ndarray, gauge: float, minutes: float = 1.0, minute: float = 0.0
) -> NextReading:
    return worth_of("a", costs, shown, gauge, minutes, minute)


def gaussian(mean: float) -> tuple[np.ndarray, np.ndarray]:
    """Return two sources, and the costs of a decision that costs their sum and of one that costs nothing."""
    both = SeedTree(1).child("gaussian").generator().standard_normal((UNITS, 2)) * [1.5, 0.8]
    return both, np.stack([mean + both.sum(axis=1), np.zeros(UNITS)], axis=1)


@pytest.mark.parametrize("mean", [0.0, 0.7, -1.2])
@pytest.mark.parametrize("gauge", [0.0, 0.5, 3.0])
def test_worth_of_a_reading_of_a_normal_source_is_the_closed_form(mean, gauge):
    """The difference that is known after the reading is normal with τ² = σ⁴/(σ² + s²); the gain is E|·| of it."""
    both, costs = gaussian(mean)
    for at, sigma in enumerate((1.5, 0.8)):
        spread = sigma**2 / np.hypot(sigma, gauge)
        gain = spread * stats.norm.pdf(mean / spread) - abs(mean) * stats.norm.cdf(-abs(mean) / spread)
        found = reading(costs, both[:, at], gauge)
        # Classes instead of numbers lose under 1 %, and the little where no unit is decided otherwise; four standard
        # errors.
        assert -0.01 * gain - 1e-4 - 4 * found.error < found.gain - gain < 4 * found.error


@pytest.mark.parametrize("seed", range(20))
def test_a_reading_is_worth_no_less_than_nothing_and_no_more_than_to_know_the_unit(seed):
    generator = SeedTree(seed).child("bounds").generator()
    costs = generator.exponential(10.0, (512, 5)) * (generator.random((512, 5)) < 0.4)
    shown = costs @ generator.standard_normal(5) + generator.standard_normal(512)
    for gauge in (0.0, 1.0, 1000.0):
        found = reading(costs, shown, gauge)
        assert 0.0 <= found.gain <= costs.mean(axis=0).min() - costs.min(axis=1).mean()
        assert found.before == pytest.approx(costs.mean(axis=0).min())


def test_an_exact_gauge_of_a_source_that_decides_alone_is_worth_all_there_is_to_know():
    bad = SeedTree(2).child("alone").generator().random(4096) < 0.3
    costs = np.stack([100.0 * bad, np.full(4096, 20.0)], axis=1)
    found = reading(costs, np.where(bad, 5.0, 1.0), 0.0)
    assert found.gain == pytest.approx(costs.mean(axis=0).min() - costs.min(axis=1).mean())
    assert found.gain == pytest.approx(14.0, abs=4 * found.error)


def test_a_gauge_that_shows_another_source_does_not_pay_however_many_are_tried():
    """What chance seems to teach is not sold: of 200 readings of nothing hardly one pays at a low price."""
    generator = SeedTree(3).child("nothing").generator()
    costs = 100.0 * (generator.random((512, 4)) < 0.5)
    found = [reading(costs, generator.standard_normal(512), 0.1, 1.0, 0.5) for _ in range(200)]
    assert sum(own.pays for own in found) <= 2
    assert np.mean([own.gain for own in found]) < 1.0


class Toy:
    """Units that miss if the sum of four sources is above 2.5; the bench tells the sum, to 0.3."""

    spread, limit, bench = np.array([1.2, 1.0, 0.8, 0.6]), 2.5, 0.3
    scrap, change, minutes, minute, gauge = 100.0, np.array([20.0, 20.0, 12.0, 12.0]), 5.0, 0.6, 0.15

    def __init__(self, generator: np.random.Generator) -> None:
        """Draw a unit that the bench calls bad."""
        self.generator, self.read = generator, dict[int, float]()
        while True:
            self.unit = self.spread * generator.standard_normal(4)
            self.shown = self.unit.sum() + self.bench * generator.standard_normal()
            if self.shown > self.limit:
                return

    def measure(self, at: int) -> None:
        self.read[at] = self.unit[at] + self.gauge * self.generator.standard_normal()

    def likely(self, count: int = 512) -> np.ndarray:
        """Return units as likely as this one after what was read."""
        rows = np.array([np.ones(4), *(np.eye(4)[at] for at in self.read)])
        noise = np.array([self.bench, *(self.gauge for _ in self.read)]) ** 2
        prior = np.diag(self.spread**2)
        weight = prior @ rows.T @ np.linalg.inv(rows @ prior @ rows.T + np.diag(noise))
        mean, covariance = weight @ [self.shown, *self.read.values()], prior - weight @ rows @ prior
        return self.generator.multivariate_normal(mean, covariance, count)

    def costs(self, units: np.ndarray) -> np.ndarray:
        """Return what scrap, no change and each change cost on average."""
        rest = units.sum(axis=1, keepdims=True) - units
        missed = stats.norm.sf((self.limit - rest) / self.spread)
        keep = self.scrap * (units.sum(axis=1) > self.limit)
        return np.column_stack([np.full(len(units), self.scrap), keep, self.change + self.scrap * missed])

    def paid(self, decision: int) -> float:
        return float(self.costs(self.unit[np.newaxis])[0, decision]) + self.minutes * self.minute * len(self.read)


def followed(toy: Toy) -> float:
    while True:
        units = toy.likely()
        costs = toy.costs(units)
        found = [
            (worth_of(str(at), costs, units[:, at], toy.gauge, toy.minutes, toy.minute), at)
            for at in range(4)
            if at not in toy.read
        ]
        paying = [own for own in found if own[0].pays]
        if not paying:
            return toy.paid(int(costs.mean(axis=0).argmin()))
        toy.measure(max(paying, key=lambda own: own[0].worth)[1])


def suspected(toy: Toy) -> float:
    return toy.paid(2 + int(toy.likely().mean(axis=0).argmax()))


def all_measured(toy: Toy) -> float:
    for at in range(4):
        toy.measure(at)
    return toy.paid(int(toy.costs(toy.likely()).mean(axis=0).argmin()))


@pytest.mark.slow
def test_to_follow_the_advice_costs_less_than_to_suspect_and_than_to_measure_everything():
    seeds, paid = SeedTree(4).child("policies"), []
    for number in range(200):
        same = [policy(Toy(seeds.child(str(number)).generator())) for policy in (followed, suspected, all_measured)]
        paid.append(same)
    saved = np.array(paid)[:, 1:] - np.array(paid)[:, :1]
    standard_error = saved.std(axis=0, ddof=1) / np.sqrt(len(saved))
    assert (saved.mean(axis=0) > 2 * standard_error).all()


PRICES = """
limit_arcsec = 45
scrap = 900
minute = 1.2
[change]
"disc1.*" = 150
"pin.*" = 0
[minutes]
"*" = 15
"pin.*" = 5
[gauges]
"housing.*" = 2
[read]
"disc1.pitch" = 7.5
"""


def test_prices_of_a_file_are_those_of_the_last_pattern_that_means_a_source(tmp_path):
    file = tmp_path / "repair.toml"
    file.write_text(PRICES, encoding="utf-8")
    errors = load_drawing("rv20e_table4").errors
    repair = load_repair(file, errors)
    found = {errors.active[at].name: (minutes, gauge) for at, minutes, gauge in repair.candidates(errors.active)}
    assert found["pin.diameter"] == pytest.approx((5.0, 0.5e-6))
    assert found["housing.pitch"] == pytest.approx((15.0, 2e-6))
    assert "disc1.pitch" not in found  # it was read
    (read,) = repair.readings(errors.active)
    assert (read.source.name, read.value, read.deviation) == ("disc1.pitch", pytest.approx(7.5e-6), 0.5e-6)
    assert repair.missed == 900


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("limit_arcsec = 45", "limit_arcsec = 0", "limit_arcsec is 0; input should be greater than 0"),
        ("scrap = 900", "scrap = -1", "scrap is -1; input should be greater than or equal to 0"),
        ("scrap = 900", "scrp = 900", "unknown field 'scrp'; the nearest known is scrap"),
        ("minute = 1.2", "", "minute is missing"),
        ("minute = 1.2", 'minute = 1\ncurrency = "Euro"', "currency is 'Euro'; allowed are three letters such as EUR"),
        ('"*" = 15\n"pin.*" = 5', "", "minutes: allowed is one source or more, each with its minutes"),
        ('"*" = 15', '"*" = 0', "minutes.* is 0; input should be greater than 0"),
        (
            '"disc1.*" = 150',
            '"disk1.*" = 150',
            "unknown source of change 'disk1.*'; the nearest known are disc1",
        ),
        ('"disc1.pitch" = 7.5', '"disc1.*" = 7.5', "unknown source of read 'disc1.*'"),
        (
            '"disc1.pitch" = 7.5',
            '"disc1.pitch" = "thick"',
            "read.disc1.pitch is 'thick'; input should be a valid number",
        ),
    ],
)
def test_prices_that_are_not_allowed_are_refused_in_one_sentence(tmp_path, old, new, said):
    assert old in PRICES
    (tmp_path / "repair.toml").write_text(PRICES.replace(old, new), encoding="utf-8")
    errors = load_drawing("rv20e_table4").errors
    assert said in refusal(lambda path: load_repair(path, errors), tmp_path / "repair.toml")


def test_a_changed_part_is_drawn_anew_and_all_others_stay(prepared):
    """A unit whose housing alone is bad is mended by another housing and by nothing else."""
    kernel, errors = prepared.model.kernel, prepared.errors
    unit = np.zeros((6, len(errors.columns)))
    unit[:, errors.columns.index("housing.pitch.cos2")] = 12e-6
    prices = {"limit_arcsec": 30, "scrap": 900, "minute": 1, "minutes": {"*": 5}}
    repair = Repair(**prices, change={"housing.*": 100, "pin.diameter": 10})
    decisions, costs = repair_costs(kernel, errors, unit, repair, SeedTree(6).generator())
    assert decisions == ("scrap it", "leave it as it is", "change housing.*", "change pin.diameter")
    assert (costs[:, 0] == 900).all() and (costs[:, 1] == 900).all() and (costs[:, 3] == 910).all()
    assert 100 <= costs[:, 2].mean() < 700
    assert set(((costs[:, 2] - 100) / 225).tolist()) <= {0.0, 1.0, 2.0, 3.0, 4.0}

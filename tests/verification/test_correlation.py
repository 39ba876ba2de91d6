"""Correlated sources: what is asked for is what is drawn, and a file that cannot be meant is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.special import ndtr
from scipy.stats import kstest

from tests.builders import source
from tolalloc.drawings.correlation import CorrelatedSource, Correlation, Pair, load_correlations
from tolalloc.drawings.distributions import Batch, Distribution
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.sources import Source
from tolalloc.drawings.zones import Feature
from tolalloc.exceptions import InputError, UnknownNameError

SAMPLES = 40_000


SIZES = tuple(source(name) for name in ("a", "b", "c", "d"))
PITCHES = tuple(source(f"disc{disc}.pitch", feature=Feature.PITCH, spectrum=((1, 2.0), (5, 1.0))) for disc in (1, 2))
BORES = tuple(source(f"disc{disc}.bore{bore}", feature=Feature.POSITION) for disc in (1, 2) for bore in (1, 2, 3))

VECTORS = [
    {"distribution": Distribution.UNIFORM},
    {"distribution": Distribution.TRIANGULAR},
    {"distribution": Distribution.LOGNORMAL, "shape": 0.5},
    {"distribution": Distribution.WEIBULL, "shape": 1.5},
    {"distribution": Distribution.MIXTURE, "batches": (Batch(weight=1.0, shift=0.0, spread=0.6),)},
    {"sorted": True, "cp": 0.5},
    {},
]


def model(*pairs: tuple[str, str, float], sources: tuple[Source, ...] = SIZES, **others) -> ErrorModel:
    return ErrorModel(
        sources,
        correlation=Correlation(pairs=tuple(Pair(one=a, other=b, correlation=c) for a, b, c in pairs)),
        **others,
    )


def write(folder: Path, rows: list[list[object]], suffix: str = ".csv") -> Path:
    path, frame = folder / f"correlations{suffix}", pd.DataFrame(rows)
    if suffix == ".csv":
        frame.to_csv(path, header=False, index=False)
    else:
        frame.to_excel(path, header=False, index=False)
    return path


def test_sampled_correlation_is_the_one_asked_for_and_sources_keep_their_distribution(generator):
    joint = CorrelatedSource(name="k", columns=("k1", "k2"), covariance=np.array([[1.0, 0.5], [0.5, 1.0]]))
    errors = model(
        ("a", "b", 0.7), ("b", "c", -0.4), ("disc1.bore1", "disc2.bore1", 0.9), sources=SIZES + BORES, joint=(joint,)
    )
    values = errors.standard_values(generator.random((SAMPLES, len(errors.columns))))
    asked = errors.normal_correlation.copy()
    asked[-2:, -2:] = joint.covariance
    # A normal sample's correlation has the standard error (1 − ρ²)/√n; four of them, for 171 pairs.
    np.testing.assert_array_less(np.abs(np.corrcoef(values.T) - asked), 4 * (1 - asked**2) / np.sqrt(SAMPLES) + 1e-12)
    for column in values.T:
        assert kstest(column / column.std(), "norm").pvalue > 1e-4


def test_a_uniform_source_stays_uniform_and_an_independent_one_keeps_every_bit(generator):
    sources = (source("a", distribution=Distribution.UNIFORM), *SIZES[1:])
    errors, uniform = model(("a", "c", 0.8), sources=sources), generator.random((SAMPLES, 4))
    dependent = errors.dependent(uniform)
    np.testing.assert_array_equal(dependent[:, [1, 3]], uniform[:, [1, 3]])
    for column in dependent[:, [0, 2]].T:
        assert kstest(column, "uniform").pvalue > 1e-4


@pytest.mark.parametrize("correlation", [0.8, -0.8])
@pytest.mark.parametrize("features", [BORES[:2], PITCHES])
def test_vectors_that_are_not_normal_are_correlated_on_every_axis(features, correlation, generator):
    sources = tuple(replace(own, distribution=Distribution.WEIBULL, shape=1.5) for own in features)
    errors = model((sources[0].name, sources[1].name, correlation), sources=sources)
    found = np.corrcoef(errors.standard_values(generator.random((SAMPLES, len(errors.columns)))).T)
    half = len(sources[0].columns)
    # Longer tails than normal ones: five standard errors of a normal sample's correlation; 0.795 is the copula's.
    np.testing.assert_allclose(found[:half, half:], np.sign(correlation) * 0.795 * np.eye(half), atol=5 / SAMPLES**0.5)
    np.testing.assert_allclose(found[:half, :half], np.eye(half), atol=5 / SAMPLES**0.5)


@pytest.mark.parametrize("changes", VECTORS)
def test_vectors_of_every_kind_turn_with_their_normal_numbers(changes, generator):
    own = replace(BORES[0], **changes)
    normal, angle = generator.standard_normal((1000, 2)), 0.7
    turned = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    values = own.standard_values(ndtr(normal))
    np.testing.assert_allclose(own.standard_values(ndtr(normal @ turned)), values @ turned, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(own.standard_values(ndtr(-normal)), -values, rtol=1e-6, atol=1e-9)
    assert not own.standard_values(np.full((1, 2), 0.5)).any()


@pytest.mark.parametrize("correlation", [1.0, -1.0])
def test_full_correlation_makes_one_source_follow_the_other(correlation, generator):
    errors = model(("a", "b", correlation), ("b", "c", correlation), ("a", "c", 1.0))
    values = errors.standard_values(generator.random((1000, 4)))
    np.testing.assert_allclose(values[:, 1], correlation * values[:, 0], rtol=1e-6, atol=1e-7)
    np.testing.assert_allclose(values[:, 2], values[:, 0], rtol=1e-6, atol=1e-7)


def test_no_bit_depends_on_the_samples_beside(generator):
    errors = model(*((one, other, 0.3) for one, other in ("ab", "ac", "bd", "cd")))
    uniform = generator.random((700, 4))
    whole = errors.standard_values(uniform)
    parts = [errors.standard_values(uniform[rows]) for rows in (slice(0, 1), slice(1, 500), slice(500, 700))]
    np.testing.assert_array_equal(np.concatenate(parts), whole)


@pytest.mark.parametrize("suffix", [".csv", ".xlsx"])
def test_a_list_of_groups_correlates_every_pair_of_a_group(tmp_path, suffix):
    rows = [["sources", "correlation", "note"], ["disc1.bore*", 0.6, "one fixture"], ["a; disc2.bore[!0-9]x b", 1, ""]]
    path = write(tmp_path, rows[:2], suffix)
    errors = ErrorModel(SIZES + BORES, correlation=load_correlations(path, SIZES + BORES))
    assert errors.blocks[4] == ("disc1.bore1", "disc1.bore2", "disc1.bore3")
    assert errors.correlation.mappings(errors.sources) == (
        "disc1.bore1, disc1.bore2, disc1.bore3: correlation 0.6 of each with each",
    )
    with pytest.raises(UnknownNameError, match=r"row 3: unknown source 'disc2.bore\[!0-9\]x'"):
        load_correlations(write(tmp_path, rows, suffix), SIZES + BORES)


@pytest.mark.parametrize("suffix", [".csv", ".xlsx"])
def test_a_matrix_gives_the_same_as_its_list(tmp_path, suffix):
    rows = [["", "c", "a", "b"], ["c", 1, 0.5, 0], ["a", 0.5, 1, -0.25], ["b", 0, -0.25, 1]]
    by_matrix = load_correlations(write(tmp_path, rows, suffix), SIZES)
    rows = [["note", "sources", "correlation"], ["", "c a", 0.5], ["", "b;a", -0.25], ["again", "a c", 0.5]]
    by_list = load_correlations(write(tmp_path, rows, suffix), SIZES)
    np.testing.assert_array_equal(by_matrix.source_matrix(SIZES), by_list.source_matrix(SIZES))
    assert by_matrix.source_matrix(SIZES)[0].tolist() == [1.0, -0.25, 0.5, 0.0]
    assert by_matrix.mappings(SIZES) == ("a, b, c: correlation -0.25 (a with b), 0.5 (a with c)",)


@pytest.mark.parametrize(
    ("other", "columns"),
    [
        (source("b", feature=Feature.POSITION), r"a\.cos1 with b\.x"),
        (source("b", feature=Feature.RUNOUT, spectrum=((5, 1.0),)), r"a\.cos1 with b\.cos5"),
        (source("b", feature=Feature.RUNOUT, spectrum=((1, 1.0), (2, 1.0))), r"nothing with b\.cos2"),
        (source("b", each=2), r"a\.cos1 with b\.1"),
    ],
)
def test_sources_with_unlike_columns_are_refused(other, columns):
    own = source("a", feature=Feature.RUNOUT, spectrum=((1, 1.0),))
    with pytest.raises(InputError, match=f"correlations, a with b: columns is '{columns}'; allowed is like columns"):
        model(("a", "b", 0.5), sources=(own, other))


LIST = ["sources", "correlation"]
BAD = [
    ([LIST, ["a b", 0.5], ["a aa", 0.1]], r"row 3: unknown source 'aa'"),
    ([LIST, ["a b", 1.5]], r"row 2, a with b: correlation is 1\.5; allowed is -1 to 1"),
    ([LIST, ["a b", "nan"]], r"row 2, a with b: correlation is nan"),
    ([LIST, ["a b", "0,5"]], r"row 2 \(a b\): correlation is '0,5'"),
    ([LIST, ["a b", ""]], r"row 2 \(a b\): correlation is ''"),
    ([LIST, ["a", 0.5]], r"row 2: sources is 'a'; allowed is two or more"),
    ([LIST, ["", 0.5]], r"row 2: sources is ''"),
    ([LIST, ["a b", 0.5], ["*", 0.4]], r"row 3, a with b: correlation is 0\.4; allowed is .*row 2 says 0\.5"),
    ([LIST, ["a disc1.bore1", 0.5]], r"row 2, a with disc1\.bore1: columns is 'a with disc1\.bore1\.x'"),
    ([LIST, ["a b c", -0.9]], r"least eigenvalue of the correlation matrix is -0\.8; .* -0\.9 of [abc] with [abc]"),
    ([LIST], r"no rows below its header"),
    ([["sources", "corelation"], ["a b", 0.5]], r"row 1: unknown column 'corelation'; .* correlation"),
    ([["sources", "correlation", "notes"], ["a b", 0.5, ""]], r"row 1: unknown column 'notes'"),
    ([["source", "correlation"], ["a b", 0.5]], r"row 1: unknown column 'source'"),
    ([["note", "correlation"], ["a b", 0.5]], r"row 1: number of columns 'sources' is 0; allowed is 1"),
    ([["", "a", "b"], ["a", 1, 0.5], ["b", 0.4, 1]], r"row 3, b with a: correlation is 0\.4; .*row 2 says 0\.5"),
    ([["", "a", "b"], ["a", 1, 0.5], ["b", 0.5, 0.9]], r"row 3 \(b\): value on the diagonal is 0\.9; allowed is 1"),
    ([["", "a", "b"], ["a", 1, 0.5]], r"row 2: the matrix is not square"),
    ([["", "a", "b"], ["b", 1, 0.5], ["a", 0.5, 1]], r"row 3: the matrix is not square"),
    ([["", "a", "b"], ["a", 1, 0.5], ["b", 0.5, ""]], r"row 3 \(b with b\): correlation is ''"),
    ([["", "a", "a"], ["a", 1, 1], ["a", 1, 1]], r"row 1: column is 'a'; allowed is each source once"),
    (
        [["", "a", "b", "c"], ["a", 1, 0.9, 0.9], ["b", 0.9, 1, -0.9], ["c", 0.9, -0.9, 1]],
        r"least eigenvalue of the correlation matrix is -0\.8",
    ),
]


@pytest.mark.parametrize(("rows", "sentence"), BAD)
def test_what_cannot_be_meant_is_refused_with_its_row_and_value(tmp_path, rows, sentence):
    path = write(tmp_path, rows)
    with pytest.raises((InputError, UnknownNameError), match=sentence) as refused:
        load_correlations(path, SIZES + BORES)
    assert str(refused.value).startswith(str(path))
    assert str(refused.value).count("\n") == 0


def test_files_that_are_no_tables_are_refused(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        load_correlations(tmp_path / "none.csv", SIZES)
    whole = write(tmp_path, [["", "a", "b"], ["a", 1, 0.5], ["b", 0.5, 1]], ".xlsx")
    whole.write_bytes(whole.read_bytes()[:-300])
    with pytest.raises(InputError, match="truncated"):
        load_correlations(whole, SIZES)
    text = tmp_path / "text.csv"
    for content, sentence in (
        (b"", "the table is empty; a header and rows are needed"),
        (b"\xff\xfe\x00", "row 1 looks like UTF-16; save it as CSV UTF-8"),
        (b"sources,correlation\na b,0.5,too,many\n", "row 2: 4 cells stand under 2 headers; numbers have a decimal"),
        (b',a,b\na,"1,0.5\n', "row 2: a quotation mark is not closed"),
        (b",a,b\na,1,0.5\nb,0.5", r"row 3: 2 of 3 cells are there; is the file truncated\?"),
    ):
        text.write_bytes(content)
        with pytest.raises(InputError, match=sentence):
            load_correlations(text, SIZES)
    text.write_text(",a,b\na,1,0.5\nb,0.5\n")
    with pytest.raises(InputError, match=r"row 3 \(b with b\): correlation is ''"):
        load_correlations(text, SIZES)


def test_a_source_without_a_zone_takes_no_part(generator):
    sources = (source("a", zone=0.0), *SIZES[1:])
    errors = model(("a", "b", 0.9), ("c", "d", 0.5), sources=sources)
    assert errors.blocks == (("b",), ("c", "d"))
    assert errors.standard_values(generator.random((5, 3))).shape == (5, 3)

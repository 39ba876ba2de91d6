"""Who calls the package reads the name of an argument, who types a command that of its option."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.builders import baseline_errors
from tests.studies.command import refused, tolalloc
from tolalloc.exceptions import InputError
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.wings.bench.diagnosis import DiagnosisRequest


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["diagnose", "x.csv", "--noise", "70"], "tolalloc diagnose: --noise is 70.0; allowed is above 0 up to 60."),
        (["modify", "li2018", "--radial", "-5"], "tolalloc modify: --radial is '-5 µm'; allowed is 0 to 1000 µm."),
        (["simulate", "--torque", "5"], "tolalloc simulate: --torque is 5.0"),
        (["assemble", "rv20e", "--seed", "-1"], "tolalloc assemble: --seed is -1"),
    ],
)
def test_a_command_says_its_option_where_the_package_says_an_argument(words, said):
    refused(tolalloc(*words), said)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["rank", "x.py", "--seed", "x"], "Error: tolalloc rank: --seed is 'x'; allowed is a whole number."),
        (
            ["assemble", "rv20e", "--seed", "1.5"],
            "Error: tolalloc assemble: --seed is '1.5'; allowed is a whole number.",
        ),
        (["whatif", "x.py", "a=1", "--units", "many"], "--units is 'many'; allowed is a whole number."),
        (["allocate", "x.py", "--limit", "60 arcsec"], "--limit is '60 arcsec'; allowed is a number."),
    ],
)
def test_an_option_that_is_no_number_is_refused_in_one_sentence(words, said):
    result = tolalloc(*words)
    refused(result, said)
    assert len(result.stderr.strip().splitlines()) == 1


def test_the_package_says_its_argument():
    with pytest.raises(InputError, match=r"^diagnosis: noise_arcsec is 70; allowed is above 0 up to 60\.$") as error:
        DiagnosisRequest(
            curve=Path("x.csv"),
            reducer=load_reducer("rv20e"),
            errors=baseline_errors(),
            noise_arcsec=70,
        )
    assert error.value.argument == "noise_arcsec"


def test_a_place_that_has_the_name_of_the_argument_is_left_out():
    error = InputError.of_argument("my_torque_bench", "torque", 0.0, "another")
    assert str(error.as_option("tolalloc te", "--torque")) == "tolalloc te: --torque is 0.0; allowed is another."

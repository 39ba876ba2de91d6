"""Values of the validation manual, which tests show: a printed number that is no more so fails where it is computed."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

CASES: dict[str, dict[str, Any]] = {
    case["number"]: case
    for case in tomllib.loads(
        (Path(__file__).parents[1] / "docs" / "reference" / "cases.toml").read_text(encoding="utf-8")
    )["case"]
}
AT_MOST = "≤ "


def shown(number: str, value: float) -> None:
    """Assert that a case prints this value to its last digit, or a bound that it keeps."""
    printed = CASES[number]["value"]
    if printed.startswith(AT_MOST):
        assert value <= float(printed.removeprefix(AT_MOST)), f"case {number} prints {printed}"
        return
    last = 10.0 ** -len(printed.partition(".")[2])
    assert abs(value - float(printed)) <= 0.5 * last * (1 + 1e-9), f"case {number} prints {printed}, found {value:.9g}"

"""Files of measuring rooms (Q-DAS, AQDEF): what is measured of a part, and the values that were found."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from tolalloc.drawings.table_file import plain_number
from tolalloc.exceptions import InputError
from tolalloc.reading.file_content import is_file, read_bytes

FILE_NAME = re.compile(r"(.+\.(?:dfq|dfd|dfx))(?::(.*))?", re.IGNORECASE)
"""Name of a Q-DAS file, and of the characteristic behind it."""
_KEY = re.compile(r"(K\d{4})(?:/(\d{1,6}))?(?:\s+(.*))?")
"""Line of such a file that begins with a field: its key, the characteristic that it is about, and its content."""
_BETWEEN_CHARACTERISTICS, _BETWEEN_FIELDS = "\x0f", "\x14"
_BEGIN = ("K1001", "K2001")
"""Fields with which the description of a part, and of a characteristic, begins; behind values it is that of another."""
VALID = "0"
"""Content of K0002 of a value that counts; 129, 255, 256 and 290 mark one that does not."""
_ATTRIBUTIVE = "1"
"""Content of K2004 of a characteristic that is counted, not measured."""
_DECIMALS = 6
"""Decimals of a length that is written [mm]: a nanometre."""
_SIGNIFICANT, _IMPORTANT = "3", "2"
"""Class of a characteristic, K2005."""
NATURAL = "2"
"""Kind of a lower limit, K2120, that nature sets: zero of a position."""
NUMBER, NAME, SHORT = "K2001", "K2002", "K2003"
"""Keys of what a characteristic is called: its number, its name and its short name."""


@dataclass(frozen=True)
class Characteristic:
    """What a Q-DAS file says of one characteristic."""

    fields: dict[str, str] = field(default_factory=dict)  # K2… → content
    values: list[tuple[str, str]] = field(default_factory=list)  # Value (K0001) and attribute (K0002), as written

    @property
    def names(self) -> tuple[str, ...]:
        """Number and name, as far as the file has them."""
        return tuple(self.fields[key] for key in (NUMBER, NAME) if self.fields.get(key))


@dataclass(frozen=True, kw_only=True)
class Described:
    """What a file that is written says of one characteristic."""

    number: str
    short: str  # What a reader of values knows it by
    name: str
    nominal: float  # [mm]
    lower: float | None  # Deviation from nominal; none of what cannot lie below zero [mm]
    upper: float  # Deviation from nominal [mm]
    is_driver: bool  # Whether it is significant, else it is important
    remark: str = ""

    @property
    def fields(self) -> Iterator[tuple[str, str]]:
        """Keys with their content."""
        lower, (low, high) = self.lower or 0.0, (self.nominal + (self.lower or 0.0), self.nominal + self.upper)
        yield from ((NUMBER, self.number), (NAME, self.name), (SHORT, self.short), ("K2004", "0"))
        yield from (("K2005", _SIGNIFICANT if self.is_driver else _IMPORTANT), ("K2022", str(_DECIMALS)))
        lengths = {"K2101": self.nominal, "K2110": low, "K2111": high, "K2112": lower, "K2113": self.upper}
        yield from ((key, f"{length:.{_DECIMALS}f}") for key, length in lengths.items())
        yield from (("K2120", NATURAL),) if self.lower is None else ()
        yield from (("K2142", "mm"), ("K2900", self.remark))


def write_description(title: str, described: Sequence[Described], path: Path) -> None:
    """Write a file that describes characteristics, without values, for a measuring room's program.

    References
    ----------
    Q-DAS ASCII Transfer Format, version 12 (2015): K0100 number of characteristics, K1001 and K1002 part, K2001 number,
    K2002 name, K2003 short name, K2004 kind, K2005 class, K2022 decimals, K2101 nominal size, K2110 and K2111 limits,
    K2112 and K2113 allowances, K2120 kind of the lower limit, K2142 unit, K2900 remark.
    """
    lines = [f"K0100 {len(described)}", f"K1001 {title}", f"K1002 {title}"]
    lines += [f"{key}/{at} {text}" for at, own in enumerate(described, start=1) for key, text in own.fields if text]
    path.write_text("".join(" ".join(line.split()) + "\r\n" for line in lines), encoding="utf-8", newline="")


def read_characteristics(path: Path) -> dict[int, Characteristic]:
    """Return what a Q-DAS file (AQDEF) says of every characteristic that has values.

    Notes
    -----
    Read are the fields of characteristics (K2…) and values with their attribute (K0001, K0002); in lines of values
    byte 15 separates characteristics and byte 20 the fields of one value. A field with index 0 is about all. This is
    own code: the library aqdefreader 1.3.0 needs packages that it does not name, prints, leaves `K0001/1 5.001` a
    text and fails on lines of values with decimal commas or operators, as measuring machines write them.

    References
    ----------
    Q-DAS ASCII Transfer Format, version 12 (2015), and Hexagon's lists of the contents of K00xx and K2xxx.
    """
    lines = _text_of(path).splitlines()
    if path.suffix.lower() == ".dfd":
        beside = [path.with_suffix(end) for end in (".dfx", ".DFX")]
        found = next((own for own in beside if is_file(own)), beside[0])
        lines += _text_of(found).splitlines()
    return {at: own for at, own in _parsed(lines, path).items() if own.values}


def read_description(path: Path) -> dict[int, Characteristic]:
    """Return what a Q-DAS file says of every characteristic, whether it has values or not."""
    return _parsed(_text_of(path).splitlines(), path)


def _parsed(lines: Sequence[str], path: Path) -> dict[int, Characteristic]:
    """Return the characteristics that lines of a file describe, with their values."""
    common, found_by = dict[str, str](), dict[int, Characteristic]()
    for number, line in enumerate(lines, start=1):
        if key := _KEY.fullmatch(line.rstrip()):
            described = list(found_by.values()) if key[1] == "K1001" else [found_by.get(int(key[2] or 1))]
            if key[1] in _BEGIN and any(own and own.values for own in described):
                raise InputError(
                    f"{path}, line {number}: a second part begins ({line.strip()}), and its characteristics have the "
                    "numbers of the first one's; allowed is a file a part."
                )
            _read_field(key[1], int(key[2] or 1), (key[3] or "").strip(), found_by, common)
        elif line.strip() and not line.startswith("K"):
            for at, written in enumerate(line.split(_BETWEEN_CHARACTERISTICS), start=1):
                _read_value(written.split(_BETWEEN_FIELDS), found_by.setdefault(at, Characteristic()))
    for characteristic in found_by.values():
        characteristic.fields.update({key: own for key, own in common.items() if key not in characteristic.fields})
    return dict(sorted(found_by.items()))


def _text_of(path: Path) -> str:
    """Return the text of a Q-DAS file, which measuring machines write in UTF-8, UTF-16 or Windows-1252."""
    content = read_bytes(path, "a Q-DAS file")
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return content.decode("utf-16", "replace")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("cp1252", "replace")


def _read_field(key: str, at: int, content: str, found: dict[int, Characteristic], common: dict[str, str]) -> None:
    """Take a field of a characteristic, or of all of them."""
    if key.startswith("K2"):
        (found.setdefault(at, Characteristic()).fields if at else common)[key] = content
    elif key == "K0001" and at:
        found.setdefault(at, Characteristic()).values.append((content, VALID))
    elif key == "K0002":
        for own in [found[at]] if at in found else list(found.values()) if not at else []:
            if own.values:
                own.values[-1] = (own.values[-1][0], content)


def _read_value(fields: list[str], own: Characteristic) -> None:
    """Take one value of a line of values; one that is empty was not measured."""
    if own.fields.get("K2004") != _ATTRIBUTIVE and fields[0].strip():
        attribute = fields[1].strip() if len(fields) > 1 else ""
        own.values.append((fields[0].strip(), attribute or VALID))


def qdas_number(text: str) -> float:
    """Return a number with a decimal comma or point, not a number where it is none."""
    try:
        return plain_number(text.strip().replace(",", "."))
    except ValueError:
        return float("nan")

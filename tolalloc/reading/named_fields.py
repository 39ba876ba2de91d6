"""Records that users write, whose fields are given by name and say themselves what they allow.

A field is annotated with a rule, ``Annotated[float, number("above 0", above=0)]``; a wrong one is refused in one
sentence: where, which field, what it is, what is allowed.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, dataclass, fields
from functools import cache
from inspect import get_annotations
from math import inf, isfinite
from numbers import Real
from typing import Any, ClassVar, Self, get_args

from tolalloc.exceptions import InputError, UnknownNameError


def is_number(value: object) -> bool:
    """Return whether a value is a number of any kind that a float can be, NumPy's too; True and False are none."""
    if not isinstance(value, Real) or isinstance(value, bool):
        return False
    try:
        float(value)
    except OverflowError:  # a whole number of more than 308 digits
        return False
    return True


@dataclass(frozen=True)
class Rule:
    """What a field of a record, or an argument, may hold."""

    allowed: str  # The same in words, as a refusal says it
    keeps: Callable[[Any], bool]  # Whether a value is allowed
    name: str = ""  # What a refusal calls the field; its own name unless given

    def check(self, place: str, name: str, value: object, *, of_argument: bool = False) -> None:
        """Raise unless the value is allowed; of an argument, a command says its option instead."""
        if not self.keeps(value):
            refusal = InputError.of_argument if of_argument else InputError.at
            raise refusal(place, self.name or name, value, self.allowed)


def number(allowed: str, *, above: float = -inf, least: float = -inf, most: float = inf, below: float = inf) -> Rule:
    """Return the rule of a finite number in a range."""

    def keeps(value: Any) -> bool:
        return is_number(value) and isfinite(value) and above < value < below and least <= value <= most

    return Rule(allowed, keeps)


def whole(
    allowed: str, least: int, most: float = inf, *, multiple: int = 1, power_of_two: bool = False, name: str = ""
) -> Rule:
    """Return the rule of a whole number in a range, which may have to be a multiple or a power of two."""

    def keeps(value: Any) -> bool:
        good = type(value) is int and least <= value <= most and value % multiple == 0
        return good and not (power_of_two and value & (value - 1))

    return Rule(allowed, keeps, name)


def a(kind: type, allowed: str = "") -> Rule:
    """Return the rule of a value of one kind; what is allowed is said by its name unless given."""
    return Rule(allowed or f"a {kind.__name__}", lambda value: isinstance(value, kind))


def flag() -> Rule:
    """Return the rule of True or False."""
    return a(bool, "True or False")


def each(allowed: str, rule: Rule, *, fewest: int = 0) -> Rule:
    """Return the rule of a sequence whose items all keep a rule."""

    def keeps(value: Any) -> bool:
        is_sequence = isinstance(value, Sequence) and not isinstance(value, str)
        return is_sequence and len(value) >= fewest and all(map(rule.keeps, value))

    return Rule(allowed, keeps)


def mapped(allowed: str, rule: Rule) -> Rule:
    """Return the rule of a mapping from texts to values that all keep a rule."""

    def keeps(value: Any) -> bool:
        is_mapping = isinstance(value, Mapping)
        return is_mapping and all(isinstance(name, str) and rule.keeps(item) for name, item in value.items())

    return Rule(allowed, keeps)


def or_none(rule: Rule) -> Rule:
    """Return the rule that allows None besides."""
    return Rule(rule.allowed, lambda value: value is None or rule.keeps(value), rule.name)


@cache
def rules_of(record: Any) -> dict[str, tuple[Rule, ...]]:
    """Return the rules of a record's fields by name, in the order of the fields.

    An annotation is text where it stands; what it says of a type that is imported for a checker alone stands in
    quotation marks inside it.
    """
    found = {}
    for own in fields(record):
        kind: Any = own.type
        if isinstance(kind, str):
            home = next(base for base in record.__mro__ if own.name in get_annotations(base))
            names = vars(sys.modules[home.__module__])
            kind = eval(kind, names) if kind.startswith("Annotated[") else names.get(kind)
        rules = tuple(part for part in get_args(kind)[1:] if isinstance(part, Rule))
        if rules:
            found[own.name] = rules
    return found


class NamedFields:
    """Base of frozen dataclasses that a user writes: a wrong field or value is refused in one sentence."""

    called: ClassVar[str]
    """What messages call the record."""
    by_position: ClassVar[int] = 0
    """How many of its first fields may be given without their names [-]."""
    written_in: ClassVar[tuple[str, str]] = ("", "")
    """Where a refusal says that a field stands, and what it says before its name; the record itself and nothing."""

    are_arguments: ClassVar[bool] = False
    """Whether its fields are also arguments of a command, whose refusals say the option."""

    def __new__(cls, *given: object, **named: object) -> Self:
        """Refuse a field that the record does not have, by name and with the nearest one."""
        known = [own.name for own in fields(cls)]  # type: ignore[arg-type]  # every subclass is a dataclass
        for name in named:
            UnknownNameError.require(cls._place(named), "field", name, known)
        missing = [
            own.name
            for own in fields(cls)[len(given) :]  # type: ignore[arg-type]
            if own.default is MISSING and own.default_factory is MISSING and own.name not in named
        ]
        if missing:
            raise InputError(f"{cls._place(named)}: {missing[0]} is missing; write {missing[0]}=....")
        if len(given) > cls.by_position:
            first = f"{known[cls.by_position]}=..." if len(known) > cls.by_position else "nothing"
            raise InputError(f"{cls._place(named)}: {given[cls.by_position]!r} stands without its name; write {first}.")
        return super().__new__(cls)

    def __post_init__(self) -> None:
        """Refuse a value that the rule of its field does not allow."""
        place, before = self.written_in
        kind: Any = type(self)
        for name, rules in rules_of(kind).items():
            for rule in rules:
                where, value = place or self._place(vars(self)), getattr(self, name)
                rule.check(where, f"{before}{name}", value, of_argument=self.are_arguments)

    def __reduce__(self) -> tuple[Any, ...]:
        """Copy and pickle a record by its fields, without which none is made."""
        return _built, (type(self), {own.name: getattr(self, own.name) for own in fields(self)})  # type: ignore[arg-type]

    @classmethod
    def _place(cls, named: Mapping[str, Any]) -> str:
        """Return who is meant, for messages."""
        return f"{cls.called} {named['name']}" if "name" in named else cls.called


def _built(kind: type[NamedFields], named: dict[str, Any]) -> NamedFields:
    """Return the record of its fields."""
    return kind(**named)

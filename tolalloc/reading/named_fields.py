"""Records that users write, whose fields are given by name; a wrong one is refused in one sentence."""

from __future__ import annotations

from dataclasses import MISSING, fields
from numbers import Real
from typing import Any, ClassVar, Self

from tolalloc.exceptions import InputError, UnknownNameError


class NamedFields:
    """Base of frozen dataclasses that a user writes.

    A dataclass alone answers a wrong field with a bare TypeError.
    """

    called: ClassVar[str]
    """What messages call the record."""
    by_position: ClassVar[int] = 0
    """How many of its first fields may be given without their names [-]."""

    def __new__(cls, *given: object, **named: object) -> Self:
        """Refuse a field that the record does not have, by name and with the nearest one."""
        known = [own.name for own in fields(cls)]  # type: ignore[arg-type]  # every subclass is a dataclass
        for name in named:
            if name not in known:
                raise UnknownNameError.among(cls._place(named), "field", name, known)
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

    def __reduce__(self) -> tuple[Any, ...]:
        """Copy and pickle a record by its fields, without which none is made."""
        return _built, (type(self), {own.name: getattr(self, own.name) for own in fields(self)})  # type: ignore[arg-type]

    @classmethod
    def _place(cls, named: dict[str, Any]) -> str:
        """Return who is meant, for messages."""
        return f"{cls.called} {named['name']}" if "name" in named else cls.called


def _built(kind: type[NamedFields], named: dict[str, Any]) -> NamedFields:
    """Return the record of its fields."""
    return kind(**named)


def is_number(value: object) -> bool:
    """Return whether a value is a number of any kind that a float can be, NumPy's too; True and False are none."""
    if not isinstance(value, Real) or isinstance(value, bool):
        return False
    try:
        float(value)
    except OverflowError:  # a whole number of more than 308 digits
        return False
    return True

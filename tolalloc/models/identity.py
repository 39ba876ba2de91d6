"""What tells a user's function, or another thing, from everything else in any process; or that nothing does."""

from __future__ import annotations

import builtins
import copyreg
import dis
import os
import pickle
import re
import sys
from collections.abc import Iterator
from functools import _lru_cache_wrapper, cached_property
from hashlib import file_digest, sha256
from pathlib import PurePath
from types import CodeType, FunctionType, MappingProxyType, ModuleType
from typing import Any

import numpy as np

from tolalloc.reading.files import is_users_file

_NUMBERS = {int, float, bool, type(None)}
_PLAIN = {*_NUMBERS, str, bytes, complex, type(...), type(NotImplemented)}
_WRAPPERS = (property, cached_property, staticmethod, classmethod, _lru_cache_wrapper)
_WRAPPED = ("__wrapped__", "fget", "fset", "fdel", "func", "py_func", "targetoptions")  # the last two are numba's
_ON_HEAP = 1 << 9
"""Mark of a class that does not stand in machine code."""
_OUTSIDE = re.compile(
    r"(_?io|os|posix|nt|genericpath|pathlib|glob|subprocess|sqlite3|urllib|http|requests|h5py|zipfile|tarfile|ctypes"
    r"|importlib|_?socket|shelve|configparser|xml|lxml|pkgutil)\..*"
    r"|.*\.((load(?!s$)|read|open|fetch|from_?file|genfromtxt|imread|memmap)\w*|eval|exec|globals|vars|input)"
)
"""What of libraries looks at files, at other processes, or at values that its caller does not name."""
_METHOD = re.compile(r"open|iterdir|r?glob|fromfile|genfromtxt|load(txt|mat)|read_(text|bytes|csv|excel|table|json)")
"""How methods are called that do, where nobody knows whose they are before the function is called."""
_ON_MODULES = ("LOAD_ATTR", "LOAD_METHOD", "STORE", "EXTENDED_ARG")
"""What code may do with a user's module so that its names tell what it asks of it."""
_BESIDE = re.compile(r"__(dict|weakref|doc|module|annotat\w*|firstlineno|static_attributes)__|_abc_impl")
"""What a class holds that makes no difference to its values."""


class UnknownIdentityError(Exception):
    """Something may differ although all that can be seen of it is the same; the text says why."""


def identity(thing: Any) -> str:
    """Return the digest of all that a thing is made of, the same in every process.

    Of a function that is its code, what it finds by name, what it encloses and what it was given; of a value its type
    and its state; of a text or a path also the file that it names. What installed libraries define counts by its name.

    Raises
    ------
    UnknownIdentityError
        Something in it looks at what it does not hold, or has a state that nothing tells.
    """
    try:
        return _digest(thing, {}, 0)
    except UnknownIdentityError:
        raise
    except Exception as reason:  # what cannot be copied, imported or read raises what it likes
        raise UnknownIdentityError(f"{type(reason).__name__}, {reason}") from None


def _digest(thing: Any, known: dict[int, tuple[str, Any]], depth: int) -> str:
    """Return the digest of a thing; what is known is held, so that nothing else takes its place in memory."""
    if type(thing) in _PLAIN:
        return f"{type(thing).__name__} {thing!r} {_file_of(thing) if isinstance(thing, str) else ''}"
    if id(thing) not in known:
        known[id(thing)] = f"around {depth}", thing  # where it holds itself
        parts = [_digest(part, known, depth + 1) for part in _parts(thing)]
        told = repr((type(thing).__qualname__, sorted(parts) if isinstance(thing, set | frozenset) else parts))
        known[id(thing)] = sha256(told.encode()).hexdigest(), thing
    return known[id(thing)][0]


def _parts(thing: Any) -> Any:
    """Return what a thing is made of, in an order that is always the same but for sets."""
    kind = type(thing)
    if kind in (list, tuple) and {*map(type, thing)} <= _NUMBERS:
        return (sha256(pickle.dumps([*thing], protocol=4)).hexdigest(),)
    if kind in (list, tuple, set, frozenset):
        return thing
    if kind in (dict, MappingProxyType):
        return ([*thing.keys()], [*thing.values()])
    if kind is np.ndarray and not thing.dtype.hasobject:
        return (repr(thing.dtype), thing.shape, sha256(thing.tobytes()).hexdigest())
    if isinstance(thing, PurePath):
        return (str(thing),)
    if isinstance(thing, CodeType):
        counts = thing.co_argcount, thing.co_posonlyargcount, thing.co_kwonlyargcount
        names = (thing.co_names, thing.co_varnames, *counts)
        return (thing.co_code, thing.co_exceptiontable, thing.co_consts, thing.co_flags, names)
    return _of_definition(thing) if isinstance(thing, FunctionType | type) else _of_object(thing)


def _of_definition(thing: Any) -> tuple[Any, ...]:
    """Return what a class or a function is made of; a library's is its name."""
    if _stands_in(thing.__module__, thing.__qualname__, thing) or not getattr(thing, "__flags__", _ON_HEAP) & _ON_HEAP:
        return _of_library(thing.__module__, thing.__qualname__)
    if isinstance(thing, type):
        own = [(name, value) for name, value in vars(thing).items() if not _BESIDE.fullmatch(name)]
        return (thing.__qualname__, thing.__bases__, type(thing), own)
    code, home = thing.__code__, thing.__globals__
    enclosed = {name: cell.cell_contents for name, cell in zip(code.co_freevars, thing.__closure__ or (), strict=True)}
    known = {**vars(builtins), **home, **enclosed}
    named = [*_named(code, known)] if is_users_module(home.get("__name__")) else []
    held = [own for own in enclosed.items() if not isinstance(own[1], ModuleType)]
    return (code, named, held, thing.__defaults__, thing.__kwdefaults__, vars(thing))


def _named(code: CodeType, known: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield what code finds by names, as far as that is known before it runs, and what code inside it does."""
    found = None
    for step in dis.get_instructions(code):
        name, module, found = step.argval, found if isinstance(found, ModuleType) else None, None
        if module and is_users_module(module.__name__) and not step.opname.startswith(_ON_MODULES):
            raise UnknownIdentityError(f"{code.co_qualname} hands on the whole module {module.__name__}")
        if step.opname.startswith(("LOAD_GLOBAL", "LOAD_NAME", "LOAD_DEREF")):
            found = known.get(name)
        elif step.opname.startswith(("LOAD_ATTR", "LOAD_METHOD")):
            if module is None and _METHOD.fullmatch(name):
                raise UnknownIdentityError(f"{code.co_qualname} calls {name}, which may look at a file")
            found = getattr(module, name, None)
        yield from _asked(name, found, code.co_names)
    yield from _imported(code, known)
    for const in code.co_consts:
        if isinstance(const, CodeType):
            yield from _named(const, known)


def _imported(code: CodeType, known: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield what code asks of the modules that it imports when it runs."""
    constants = list[Any]()
    for step in dis.get_instructions(code):
        constants += [step.argval] if step.opname.startswith(("LOAD_CONST", "LOAD_SMALL_INT")) else []
        if step.opname == "IMPORT_NAME":
            level, names = constants[-2:]
            found = __import__(step.argval, known, None, names or (), level)
            yield from _asked(step.argval, found, code.co_names)
            if not is_users_module(found.__name__):
                yield from ((own, vars(found)[own]) for own in code.co_names if own in vars(found))


def _asked(name: str, found: Any, names: tuple[str, ...], above: tuple[ModuleType, ...] = ()) -> Iterator[Any]:
    """Yield what stands under a name; of a user's module what stands there under the names that code has."""
    if not isinstance(found, ModuleType) or not is_users_module(found.__name__):
        yield name, found
    elif found not in above:
        for own in names:
            yield from _asked(own, vars(found).get(own), names, (*above, found))


def _of_object(thing: Any) -> tuple[Any, ...]:
    """Return what an object is made of: what it wraps, or what it would be copied from."""
    home = type(thing).__module__
    if isinstance(thing, _WRAPPERS) or (hasattr(thing, "py_func") and not is_users_module(home)):
        return tuple(getattr(thing, name, None) for name in _WRAPPED)
    if isinstance(thing, ModuleType):
        return _of_library(thing.__name__, "")
    copied = copyreg.dispatch_table.get(type(thing))
    made = copied(thing) if copied else thing.__reduce_ex__(4)
    if not isinstance(made, str):
        state, items, pairs = (*made[2:], None, None, None)[:3]
        whole = object.__getstate__(thing) if is_users_module(home) else None  # a copy may do without some of it
        return (type(thing), *made[:2], state, whole, [*(items or ())], [*(pairs or ())])
    home = pickle.whichmodule(thing, made)  # type: ignore[attr-defined]
    if not _stands_in(home, made, thing):
        raise UnknownIdentityError(f"nothing tells one {type(thing).__qualname__} from another")
    return _of_library(home, made)


def _of_library(home: str, name: str) -> tuple[str, str]:
    """Return what tells something that a library defines."""
    if is_users_module(home) or _OUTSIDE.fullmatch(f"{home}.{name}"):
        raise UnknownIdentityError(f"{home}.{name} may look at what the function does not hold, such as a file")
    return home, name


def _stands_in(home: Any, name: str, thing: Any) -> bool:
    """Return whether just this thing has a name in a module of a library."""
    found = None if is_users_module(home) else sys.modules.get(home)
    for part in name.split("."):
        found = getattr(found, part, None)
    return found is thing


def is_users_module(module: Any) -> bool:
    """Return whether a module is a script of the user's, rather than of Python, of this package or a library."""
    found = sys.modules.get(module)
    path = getattr(found, "__file__", None) or next(iter(getattr(found, "__path__", ())), None)
    written = "__builtins__" in vars(found or sys)  # Python code ran there, if only from a console
    return found is None or (written if path is None else is_users_file(path))


def _file_of(name: str) -> str:
    """Return the digest of the file that a text names, nothing where there is none."""
    if not os.path.isfile(name):
        return ""
    with open(name, "rb") as file:
        return file_digest(file, "sha256").hexdigest()

"""What tells a user's function from others: everything that its values follow from, or that this is unknown."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
import time

import numpy as np
import pytest

import tolalloc as ta
from tolalloc.models.identity import UnknownIdentityError, identity
from tolalloc.models.model import Evaluation, Model

HEAD = """
import collections, dataclasses, datetime, decimal, enum, functools, math, types
import numba, numpy as np, pandas as pd, scipy.interpolate
"""

CASES = {
    # Those in which an edited study had the old answer
    "helper four calls deep": "def a(x): return K * x\ndef b(x): return a(x)\ndef c(x): return b(x)\n"
    "def d(x): return c(x)\ndef e(x): return d(x)\nK = {}\ndef f(x): return e(x)",
    "DataFrame": "T = pd.DataFrame({{'a': [1.0, {}]}})\ndef f(x): return T['a'].iloc[1] * x",
    "Series": "S = pd.Series([1.0, {}], index=['u', 'v'])\ndef f(x): return S['v'] * x",
    "spline": "S = scipy.interpolate.CubicSpline([0.0, 1.0, 2.0], [0.0, 1.0, {}])\ndef f(x): return S(x)",
    "dict six deep": "D = dict(a=dict(b=dict(c=dict(d=dict(e=dict(g={}))))))\n"
    "def f(x): return D['a']['b']['c']['d']['e']['g'] * x",
    "slots dataclass": "@dataclasses.dataclass(slots=True)\nclass P:\n    k: float\np = P({})\n"
    "def f(x): return p.k * x",
    # Others
    "dict forty deep": "D = {}\nfor _ in range(40): D = dict(a=D)\ndef f(x): return D",
    "helper thirty calls deep": "def g0(x): return {} * x\n"
    + "".join(f"def g{n + 1}(x): return g{n}(x)\n" for n in range(30))
    + "def f(x): return g30(x)",
    "partial": "def g(k, x): return k * x\nf = functools.partial(g, {})",
    "partial in a dict": "G = dict(g=functools.partial(max, {}))\ndef f(x): return G['g'](x)",
    "callable object": "class C:\n    def __init__(self, k): self.k = k\n"
    "    def __call__(self, x): return self.k * x\nf = C({})",
    "code of a callable object": "class C:\n    def __call__(self, x): return {} * x\nf = C()",
    "bound method": "class C:\n    k = {}\n    def at(self, x): return self.k * x\nf = C().at",
    "constant of a base class": "class A:\n    k = {}\nclass B(A): pass\ndef f(x): return B().k * x",
    "property": "class C:\n    @property\n    def k(self): return {}\nc = C()\ndef f(x): return c.k * x",
    "cached property": "class C:\n    @functools.cached_property\n    def k(self): return {}\nc = C()\n"
    "def f(x): return c.k * x",
    "static method": "class C:\n    @staticmethod\n    def k(): return {}\ndef f(x): return C.k() * x",
    "slots by hand": "class C:\n    __slots__ = ('k',)\nc = C()\nc.k = {}\ndef f(x): return c.k * x",
    "left out of copies": "class C:\n    def __getstate__(self): return 0\nc = C()\nc.k = {}\ndef f(x): return c.k * x",
    "list of its own kind": "class L(list): pass\nd = L([1.0, {}])\nd.a = 1\ndef f(x): return d[1] * x",
    "dict with defaults": "D = collections.defaultdict(float, k={})\ndef f(x): return D['k'] * x",
    "method of a dict": "g = dict(k={}).get\ndef f(x): return g('k') * x",
    "masked array": "A = np.ma.array([1.0, 3.0], mask=[False, {} == 1.0])\ndef f(x): return A.sum() * x",
    "named tuple": "N = collections.namedtuple('N', 'k')\nn = N({})\ndef f(x): return n.k * x",
    "enum": "class E(enum.Enum):\n    K = {}\ndef f(x): return E.K.value * x",
    "default of a lambda": "f = lambda x, k={}: k * x",
    "default by name": "def f(x, *, k={}): return k * x",
    "compiled helper": "@numba.njit\ndef g(x): return {} * x\ndef f(x): return g(x)",
    "constant of a compiled helper": "K = {}\n@numba.njit\ndef g(x): return K * x\ndef f(x): return g(x)",
    "vectorized": "f = np.vectorize(lambda x: {} * x)",
    "remembered helper": "@functools.lru_cache\ndef g(x): return {} * x\ndef f(x): return g(x)",
    "decorated": "def d(g):\n    @functools.wraps(g)\n    def h(*a): return g(*a)\n    return h\n"
    "@d\ndef f(x): return {} * x",
    "seeds": "R = np.random.default_rng(int({}))\ndef f(x): return R.normal() * x",
    "list of arrays": "def made(a):\n    return lambda x: sum(own.sum() for own in a) * x\n"
    "f = made([np.ones(3), np.array([1.0, {}])])",
    "large array in its middle": "A = np.zeros(100_000)\nA[50_000] = {}\ndef f(x): return A.sum() * x",
    "shape of an array": "A = np.zeros((2, 6)) if {} == 1.0 else np.zeros((3, 4))\ndef f(x): return A.shape[0] * x",
    "array of objects": "A = np.array([{}, None], dtype=object)\ndef f(x): return A[0] * x",
    "records": "A = np.array([(1.0, {})], dtype=[('a', float), ('b', float)])\ndef f(x): return A['b'][0] * x",
    "set": "S = {{'a', 'b', {}}}\ndef f(x): return max(S - {{'a', 'b'}}) * x",
    "view of a dict": "D = types.MappingProxyType(dict(k={}))\ndef f(x): return D['k'] * x",
    "decimal": "D = decimal.Decimal({})\ndef f(x): return float(D) * x",
    "day": "D = datetime.date(2000 + int({}), 1, 1)\ndef f(x): return D.year * x",
    "attribute of a function": "def g(x): return g.k * x\ng.k = {}\ndef f(x): return g(x)",
    "two that call each other": "def g(x): return {} if x < 0 else f(x - 1)\ndef f(x): return g(x)",
    "names of arguments": "if {} == 1.0:\n    def f(a, b): return a - b\nelse:\n    def f(b, a): return a - b",
    "what is caught": "def f(x):\n    try:\n        return math.sqrt(x)\n"
    "    except ({} == 1.0 and ValueError): return 0.0",
    "sign of a zero": "K = math.copysign(0.0, 1.5 - {})\ndef f(x): return math.atan2(K, x)",
    "kind of a number": "K = (1, 1.0)[int({}) - 1]\ndef f(x): return K",
    "name in a comprehension": "K = {}\ndef f(x): return [K * y for y in (x,)][0]",
}


@pytest.fixture
def function_of(tmp_path, monkeypatch):
    """Return what reads ``f`` of a module of a text, in place of the one before."""
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)

    def read(text, name="users_module"):
        (tmp_path / f"{name}.py").write_text(HEAD + text, encoding="utf-8")
        importlib.invalidate_caches()
        sys.modules.pop(name, None)
        return getattr(importlib.import_module(name), "f", None)

    yield read
    for name in ("users_module", "users_helper"):
        sys.modules.pop(name, None)


@pytest.mark.parametrize("text", CASES.values(), ids=CASES)
def test_an_edited_constant_makes_another_function(function_of, text):
    first, edited, again = (identity(function_of(text.format(own))) for own in ("1.0", "2.0", "1.0"))
    assert first == again != edited


@pytest.mark.parametrize(
    "text",
    [
        "import users_helper\ndef f(x): return users_helper.K * x",
        "import users_helper as h\ndef f(x): return h.g(x)",
        "from users_helper import g\ndef f(x): return g(x)",
        "from users_helper import *\ndef f(x): return K * x",
        "def f(x):\n    import users_helper\n    return users_helper.g(x)",
        "def f(x):\n    from users_helper import g\n    return g(x)",
        "import users_helper\ndef made(h):\n    return lambda x: h.g(x)\nf = made(users_helper)",
        "import users_helper\ndef f(x): return users_helper.C().at(x)",
        "import users_helper\ndef f(x): return users_helper.T[0] * x",
    ],
)
def test_a_constant_of_a_module_beside_it_makes_another_function(function_of, text):
    helper = "K = {0}\nT = np.array([1.0, K])[1:]\ndef g(x): return K * x\nclass C:\n    def at(self, x): return g(x)"
    found = []
    for own in ("1.0", "2.0", "1.0"):
        function_of(helper.format(own), "users_helper")
        found.append(identity(function_of(text)))
    assert found[0] == found[2] != found[1]


def test_a_value_that_a_module_reads_when_it_is_imported_counts(function_of, tmp_path):
    found = []
    for own in ("1.0", "2.0", "1.0"):
        (tmp_path / "k.txt").write_text(own)
        function_of(f"K = np.loadtxt({str(tmp_path / 'k.txt')!r})", "users_helper")
        found.append(identity(function_of("import users_helper\ndef f(x): return users_helper.K * x")))
    assert found[0] == found[2] != found[1]


UNKNOWN = {
    "file by a path of text": "def f(x): return float(open('k.txt').read()) * x",
    "np.loadtxt": "def f(x): return np.loadtxt('k.txt') * x",
    "np.load": "def f(x): return np.load('k' + '.npy') * x",
    "pd.read_csv": "def f(x): return pd.read_csv('k.csv')['k'].iloc[0] * x",
    "read in a helper": "def g(): return pd.read_excel('k.xlsx')\ndef h(): return g()\ndef f(x): return h()['k'] * x",
    "another name": "from numpy import genfromtxt as g\ndef f(x): return g('k.txt') * x",
    "imported when called": "def f(x):\n    import numpy as n\n    return n.load('k.npy') * x",
    "Path": "from pathlib import Path\ndef f(x): return float(Path('k.txt').read_text()) * x",
    "a path of its object": "class C:\n    def at(self, x): return float(self.path.read_text()) * x\nf = C().at",
    "partial": "f = functools.partial(np.loadtxt, 'k.txt')",
    "in a dict": "R = dict(load=np.load)\ndef f(x): return R['load']('k.npy') * x",
    "environment": "import os\ndef f(x): return float(os.environ['K']) * x",
    "other process": "import subprocess\ndef f(x): return float(subprocess.check_output('k')) * x",
    "eval": "def f(x): return eval('K') * x",
    "generator": "G = (k for k in range(9))\ndef f(x): return next(G) * x",
    "function in C": "f = np.frompyfunc(lambda x: 2 * x, 1, 1)",
    "lock": "import threading\nL = threading.Lock()\ndef f(x): return x if L.locked() else 0.0",
    "names a state of its own": "class C:\n    def __reduce__(self): return 'c'\nc = C()\ndef f(x): return c.k * x",
    "whole module": "import users_module as m\ndef g(m): return m.K\ndef f(x): return g(m) * x",
    "asked by a made name": "import users_module as m\ndef f(x): return getattr(m, 'K' + '1') * x",
    "module in a dict": "import users_module as m\nM = dict(m=m)\ndef f(x): return M['m'].K * x",
    "no module": "def f(x):\n    import no_such_module\n    return no_such_module.K * x",
    "nested endlessly": "D = 1.0\nfor _ in range(5000): D = [D, None, 'a']\ndef f(x): return D",
}


@pytest.mark.parametrize("text", UNKNOWN.values(), ids=UNKNOWN)
def test_what_cannot_be_seen_is_not_taken_for_known(function_of, text):
    with pytest.raises(UnknownIdentityError):
        identity(function_of(text))


@pytest.mark.parametrize(
    "text",
    [
        "class Spring:\n    load = 3.0\ns = Spring()\ndef f(x): return np.sqrt(s.load * x)",
        "import json\ndef f(x): return json.loads('[2]')[0] * x",
        "def f(x):\n    from scipy.optimize import brentq\n    return brentq(lambda y: y - x, -9.0, 9.0)",
        "import scipy.stats\nd = scipy.stats.norm(0.0, 2.0)\ndef f(x): return d.ppf(x)",
        "load = 2.0\nopening = 3.0\ndef f(x, readings=(1, 2)): return np.interp(x, [0, load], [0, opening])",
        "def f(x): return math.hypot(x, np.pi)",
    ],
)
def test_what_reads_nothing_is_known(function_of, text):
    assert identity(function_of(text)) == identity(function_of(text))


def test_a_text_that_names_a_file_counts_with_the_file(tmp_path):
    path = tmp_path / "k.dat"
    path.write_text("1.0")
    before = [identity(own) for own in (str(path), path, lambda: str(path))]
    path.write_text("2.0")
    after = [identity(own) for own in (str(path), path, lambda: str(path))]
    assert all(one != other for one, other in zip(before, after, strict=True))


SAME = """
def identities(head, texts):
    import sys, types
    from tolalloc.models.identity import identity
    found = []
    for text in texts:
        module = sys.modules["users"] = types.ModuleType("users")
        exec(compile(head + text, "users", "exec", dont_inherit=True), vars(module))
        found.append(identity(module.f))
    del sys.modules["users"]
    return found
"""


@pytest.mark.slow
def test_it_is_the_same_in_another_process_with_other_hashes():
    here, texts = {}, [text.format("1.0") for text in CASES.values()]
    exec(SAME, here)
    code = f"{SAME}\nprint(*identities({HEAD!r}, {texts!r}))"
    seed = "1" if os.environ.get("PYTHONHASHSEED") != "1" else "2"
    there = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONHASHSEED": seed},
        capture_output=True,
        text=True,
        check=True,
    )
    found = there.stdout.split()
    assert found == here["identities"](HEAD, texts)
    assert len({*found}) == len(texts)


def test_millions_of_numbers_take_no_time():
    """It took 34 s of a run of 2 s, in which each number was written as a text."""
    held = [0.1 * k for k in range(5_000_000)]
    start = time.process_time()
    first = identity(lambda x: x + len(held))
    assert time.process_time() - start < 5.0
    held[2_500_000] += 1e-9
    assert identity(lambda x: x + len(held)) != first


class Chain(Model):
    """A model that a user wrote."""

    name, columns, outputs, settings, steps = "chain", ("a",), ("y [mm]",), (), np.ones(1)

    def __init__(self, factor):
        self.factor = factor

    def at(self, values):
        return self

    def reading(self, outputs):
        return self

    def observed(self, observe):
        return self

    def __call__(self, x):
        return Evaluation(values=self.factor * x, status=np.zeros(len(x), dtype=np.uint8))


def test_a_model_that_a_user_wrote_is_told_by_all_that_it_holds():
    assert Chain(1.0).content == Chain(1.0).content != Chain(2.0).content


def test_sizes_and_slopes_that_the_model_states_tell_it():
    zone = {"plus": 0.01, "minus": -0.01, "unit": "mm", "min": 0.001, "max": 0.1, "cost": 1}
    errors = ta.Drawing.of_rows([{"id": "a", **zone}]).errors

    def gap(a):
        return a

    found = {
        ta.model(gap, inputs={"a": size}, outputs=("y [mm]",), slopes={"y [mm]": {"a": slope}})
        .bound(errors, "test")
        .content
        for size, slope in ((1.0, (0, 1)), (2.0, (0, 1)), (1.0, (0, 2)))
    }
    assert len(found) == 3

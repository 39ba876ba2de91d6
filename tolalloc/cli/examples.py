"""An example for the help of every command, in a folder that ``tolalloc new mine --with all`` made."""

from __future__ import annotations

EXAMPLES = {
    "new": "tolalloc new mine --like rv40e --cranks 3 --with all",
    "run": "tolalloc run mine/study.py --quick",
    "check": "tolalloc check mine/study.py",
    "open": "tolalloc open mine/study.py",
    "rank": "tolalloc rank mine/study.py --quick --pdf",
    "allocate": "tolalloc allocate mine/study.py --grades --limit 50",
    "whatif": "tolalloc whatif mine/study.py pin.diameter=3 'disc*.pitch=10'",
    "series": "tolalloc series mine/*.py --quick",
    "costs": "tolalloc costs mine/shop.csv",
    "te": "tolalloc te --reducer rv20e --unit table4 --attribute",
    "contact": "tolalloc contact --reducer mine/reducer.toml",
    "modify": "tolalloc modify li2018 --reducer mine/reducer.toml --radial 15",
    "identify": "tolalloc identify mine/bench.toml --reducer mine/reducer.toml",
    "diagnose": "tolalloc diagnose mine/unit7.csv --reducer mine/reducer.toml --tolerances mine/zones.csv",
    "assemble": "tolalloc assemble mine/chain.toml --measured mine/angles.csv",
    "mount": "tolalloc mount mine/parts.csv --reducer mine/reducer.toml",
    "simulate": "tolalloc simulate --reducer rv40e --out motion",
    "compare": "tolalloc compare runs/mine runs/other",
    "schema": "tolalloc schema reducer",
    "doctor": "tolalloc doctor",
}

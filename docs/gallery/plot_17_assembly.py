"""
Angles while a reducer is assembled
===================================

Parts are mounted, measured and turned one after the other, as zhang2025 describes it. Four axes
are adjusted against that of the pin housing.

**Read off it:** how much of each final tilt is left after adjusting.
"""

from pathlib import Path
from tempfile import mkdtemp

import tolalloc as ta

PARTS = """
[[part]]
name = "{name}"
on = "{on}"
tolerance_arcsec = [30, 30, 30]
"""
HEAD = """
name = "two cranks, two discs"
source = "zhang2025"
datum = "KC0"
precision = 10
adjust = "mounted"
measure = "current"
[effort]
just_mounted = 1
mounted_earlier = 10
not_mounted = 1000
[noise]
measurement_arcsec = 2
adjustment_arcsec = 1
"""
chain = Path(mkdtemp()) / "two.chain.toml"
order = (("KC1", "KC0"), ("KC2", "KC1"), ("KC3", "KC0"), ("KC4", "KC3"))
chain.write_text(HEAD + "".join(PARTS.format(name=name, on=on) for name, on in order), encoding="utf-8")
found = ta.assemble(str(chain))
print(found.sentences[0])
found.plot("tilt")

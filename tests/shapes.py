"""The checker of shapes and types in the full gate: as for mypy, an int may stand where a float is annotated."""

from beartype import BeartypeConf, beartype

checker = beartype(conf=BeartypeConf(is_pep484_tower=True))

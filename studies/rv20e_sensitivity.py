"""Which of all machining and assembly errors of an RV-20E drive its transmission error, lost motion and forces.

tolalloc rank studies/rv20e_sensitivity.py --quick
"""

import sys

from tolalloc.capability.indices import Limits
from tolalloc.cli.main import main
from tolalloc.study.definition import Study

study = Study(
    name="rv20e_sensitivity",
    reducer="rv20e",
    tolerances="rv20e_all_sources",
    neglected=("disc*.tilt",),
    limit_arcsec=60.0,
    yield_target=0.9973,
    other_limits={"lost motion [arcmin]": Limits(upper=1.0)},
    seed=1,
)

if __name__ == "__main__":
    sys.argv = [sys.argv[0], "rank", *sys.argv]
    main()

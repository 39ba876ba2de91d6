"""The RV-20E with the errors of liu2020's Table 4, moving: a whole output turn in the page, one of the cranks as PNG.

python studies/rv20e_moving.py [--out FOLDER]
"""

from __future__ import annotations

import numpy as np

import tolalloc as ta
from tolalloc.drawings.tolerance_table import load_tolerance_table
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reducers.scene import Scene, scene_of
from tolalloc.reducers.unit_file import load_unit
from tolalloc.reports.document import Document, Section
from tolalloc.reports.moving_picture import MovingPicture
from tolalloc.reports.scene_record import scene_record

PICTURES = 30


def table4() -> Scene:
    """Return the scene of the unit of Table 4 under the rated torque, with the places of all shipped sources."""
    reducer, unit = load_reducer("rv20e"), load_unit("table4")
    model = EquivalentModel(reducer)
    errors = unit.errors(model.columns, reducer.modification.deviations)[0]
    sources = [source.name for source in load_tolerance_table("rv20e_all_sources")]
    return scene_of(model, errors, -reducer.load.rated_torque, unit=unit.name, sources=sources)


def build(quick: bool) -> Document:
    """Return the report; a quick one has fewer pictures in its PNG."""
    scene = table4()
    picture = MovingPicture(
        name="reducer",
        title=f"{scene.reducer}, unit {scene.unit}",
        record=scene_record(scene, coarse=True),
        pictures=4 if quick else PICTURES,
    )
    ways = (scene.forward, scene.backward)
    carrying = np.concatenate([np.count_nonzero(states.force > 0.0, axis=2) for states in ways])
    widest, strongest = 1e6 * max(states.gap.max() for states in ways), max(states.force.max() for states in ways)
    return Document(
        title=f"The {scene.reducer} moving",
        subtitle=f"unit {scene.unit}, {abs(scene.forward.torque):g} N·m against the rotation",
        answer=(
            f"{carrying.min()} to {carrying.max()} pins carry a disc, either way round; the widest gap is "
            f"{widest:.1f} µm and the largest force {strongest:,.0f} N.",
        ),
        warnings=(),
        sections=(Section(heading="The reducer", figures=(picture,)),),
        assumptions=scene.assumptions,
        summary={
            "output turns until the picture closes [-]": scene.output_turns,
            "magnification [-]": scene.magnification,
            "widest gap [um]": float(widest),
            "largest pin force [N]": float(strongest),
            "pins that carry a disc, fewest and most [-]": [int(carrying.min()), int(carrying.max())],
        },
    )


study = ta.Study(questions=[ta.Calculation(build)], name="rv20e_moving")

if __name__ == "__main__":
    ta.run_script()

"""The family: an RV reducer with one spring group more, the bearing of the arm."""

from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from tolalloc.reducers.equivalent.interfaces import Interface
from tolalloc.reducers.equivalent.sources import ErrorSource
from tolalloc.reducers.equivalent.springs import Positions, SpringGroup, vector_columns
from tolalloc.reducers.families.rv import RV
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.records import ReducerRecord


@dataclass(frozen=True, kw_only=True)
class ArmBearing:
    """Table ``[arm_bearing]`` of a reducer file."""

    stiffness: Annotated[float, Field(alias="stiffness_n_per_m", ge=1e5, le=1e11)]


@dataclass(frozen=True, kw_only=True)
class ArmReducer(Reducer):
    """An RV reducer in an arm."""

    family = "RV in arm"
    lacking = "there is no bearing of an arm; this needs a table [arm_bearing]."
    arm_bearing: ArmBearing


class ArmRecord(ReducerRecord):
    """A whole file of it, which has a table ``[arm_bearing]``."""

    table = "arm_bearing"
    design = ArmReducer

    arm_bearing: ArmBearing

    def stated(self) -> dict[str, Any]:
        """Return the fields of the reducer that all families have, and the bearing."""
        return {**super().stated(), "arm_bearing": self.arm_bearing}


def arm_bearing(at: Positions) -> SpringGroup:
    """Return the two springs of the bearing, fixed in the housing at ``arm.assembly`` [m]."""
    angles, carrier = at.carrier_angle.size, at.coordinates.carrier
    displacement = np.zeros((angles, 2, at.coordinates.count))
    displacement[:, [0, 1], [carrier, carrier + 1]] = 1.0
    return SpringGroup(
        name="arm bearing",
        stiffness_name="arm_bearing",
        displacement=displacement,
        error=np.broadcast_to(-np.eye(2), (angles, 2, 2)),
        columns=vector_columns("arm.assembly"),
        stiffness=np.full((angles, 2), ArmReducer.of(at.reducer).arm_bearing.stiffness),
    )


ARM = replace(
    RV,
    name=ArmReducer.family,
    interfaces=(
        *RV.interfaces,
        Interface(
            rows=arm_bearing,
            stiffness="arm_bearing",
            sources=(ErrorSource(name="arm.assembly", fixed=True, shape="vector", place="carrier"),),
        ),
    ),
    record=ArmRecord,
    new=replace(RV.new, presets=("arm20",), table="arm20", schema="rv-in-arm", title="RV reducer in an arm"),
)

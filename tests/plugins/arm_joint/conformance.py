"""What the package brings passes the tests that anybody's does; run with the package installed."""

import arm_joint
from arm_joint.family import ARM
from arm_joint.question import Spread

import tolalloc as ta
from tolalloc.testing import FamilyTests, ModelTests, QuestionTests

assert arm_joint.__file__
RMS = "rms transmission error [arcsec]"


def study() -> ta.Study:
    """Return a study of the family's preset with the output of the package."""
    return ta.Study(
        ta.reducer("arm20", flank_clearance=(1.0, 12.0)),
        ta.drawing("arm20"),
        limits={ta.PEAK_TO_PEAK: ta.Limit(upper=110.0), RMS: ta.Limit(upper=40.0)},
        questions=[Spread(units=50)],
    )


class TestArm(FamilyTests):
    def family(self):
        return ARM


class TestArmModel(ModelTests):
    def study(self):
        return study()


class TestStack(ModelTests):
    def study(self):
        row = {"plus": 20, "minus": -20, "unit": "µm", "min": 5, "max": 100, "cost": 1}
        drawing = ta.Drawing.of_rows([{"id": "a", **row}, {"id": "b", **row}])
        return ta.Study(ta.installed_model("stack"), drawing, limits={"length [mm]": ta.Limit(upper=15.1)})


class TestSpread(QuestionTests):
    def study(self):
        return study()

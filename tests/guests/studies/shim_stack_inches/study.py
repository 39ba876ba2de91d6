"""A shim stack of an American shop: sizes and tolerances in inches."""

import tolalloc as ta

study = ta.Study(
    ta.model(
        lambda bore, flange, cone, cup: bore - flange - cone - cup,
        inputs=("bore", "flange", "cone", "cup"),
        outputs=("shim [in]",),
        name="shim stack",
    ),
    ta.drawing("stack.csv"),
    limits={"shim [in]": ta.Limit(lower=0.033, upper=0.047)},
    name="shim_stack_inches",
)

"""Clearance of a shaft in its bore, written as the fit 25 H7/h6."""

import tolalloc as ta

study = ta.Study(
    ta.model(
        lambda bore, shaft: (bore - shaft) * 1000, inputs=("bore", "shaft"), outputs=("clearance [µm]",), name="fit"
    ),
    ta.drawing("fit.csv"),
    limits={"clearance [µm]": ta.Limit(lower=2, upper=32)},
    name="fit_h7_h6",
)

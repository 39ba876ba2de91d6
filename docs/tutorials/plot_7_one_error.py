"""
One error through all equations
===============================

One part error of an RV-20E, from the drawing to the cost: the steps of :doc:`the theory </theory>` with their
numbers. The equations' numbers are those of that page. It looks below the public names, at the functions that
implement them.
"""

# %%
# The reducer
# -----------
# The RV-20E of liu2020, with its printed stiffnesses and the modification of its drawing. The output turns once for
# *i* turns of the sun, equation (4).

import matplotlib.pyplot as plt
import numpy as np

import tolalloc as ta
from tolalloc.reading.units import ARCSECOND, DEGREE, MICROMETRE, MILLIMETRE
from tolalloc.reducers.equivalent.interfaces import pin_contact
from tolalloc.reducers.equivalent.outputs import turn_orders
from tolalloc.reducers.equivalent.springs import Positions
from tolalloc.study.prepared import Prepared

study = ta.Study(
    ta.reducer("rv20e_liu2020"),
    ta.drawing("rv20e_table4"),
    limits={ta.PEAK_TO_PEAK: ta.Limit(upper=60.0)},
    questions=[ta.Allocation()],
)
prepared = Prepared(study=study)
model, errors = prepared.model, prepared.errors
reducer, stage = model.reducer, model.reducer.cycloid_stage
print(f"pins {stage.pin_count}, disc teeth {stage.disc_teeth}, eccentricity {stage.eccentricity / MILLIMETRE:g} mm")
print(f"i = {reducer.ratio:g}, K1 = e·zp/Rp = {stage.shortening:.4f}")

# %%
# The zone, and what it says of a unit
# ------------------------------------
# The diameter of the pins has this row in the tolerance table. With Cp = 1 the zone is six standard deviations wide.

source = next(own for own in errors.active if own.name == "pin.diameter")
zone = source.zone
sigma = zone / 6
print(f"zone {zone / MICROMETRE:g} µm, standard deviation {sigma / MICROMETRE:.3f} µm, cost {source.cost:g} cost units")

# %%
# Take a unit whose pins are one standard deviation too thick, and all else exact.

x = np.zeros((1, len(errors.columns)))
x[0, errors.columns.index("pin.diameter")] = sigma

# %%
# From the error to the gap
# -------------------------
# Equations (13) and (14) say how a pin meets the disc, (17) what an error does to the gap. The compression of a pin
# on the flank grows by the effective radius error itself, so thick pins close the gap everywhere alike: one to one.

at_start = Positions(reducer, np.array([0.0]))
contact = pin_contact(at_start)
lever = contact.by_disc[0, 0, 2] / MILLIMETRE
print(f"lever of the pins' normals about the disc: {lever.min():.2f} to {lever.max():.2f} mm")

# %%
# A pin far from the crank's direction has the longest lever and carries the torque; one near it has none. At the
# longest lever one micrometre of gap turns the disc by

best = np.abs(lever).max() * MILLIMETRE
print(f"{MICROMETRE / best / ARCSECOND:.2f} arcsec for 1 µm")

# %%
# From the gap to the transmission error
# --------------------------------------
# Equation (5): the parts come to rest where the energy of all springs is least, with pin contacts that only press.
# The carrier's rotation there is the transmission error. Thick pins leave less clearance, so the mean moves; the
# peak-to-peak moves little, because all pins are thick alike.

kernel = model.kernel
curves = {
    "exact parts": kernel.model.equilibria(kernel.errors(0.0 * x), kernel.torque),
    "pins one σ thick": kernel.model.equilibria(kernel.errors(x), kernel.torque),
}
pitch = x.copy()
pitch[:] = 0.0
pitch[0, errors.columns.index("housing.pitch.cos1")] = 5 * MICROMETRE
curves["pin pitch 5 µm, order 1"] = kernel.model.equilibria(kernel.errors(pitch), kernel.torque)

for label, curve in curves.items():
    error = curve.transmission_error[0] / ARCSECOND
    print(f"{label}: mean {error.mean():.2f}″, peak-to-peak {np.ptp(error):.2f}″")

# %%
# The orders
# ----------
# The waves of the curve per output turn. A pitch deviation of the housing makes multiples of zc = 39; modified teeth
# leave a little at zp·zc = 1,560, for which 936 angles are too few: it would fold back onto 312.

figure, (upper, lower) = plt.subplots(2, 1, figsize=(7, 6), constrained_layout=True)
for label, curve in curves.items():
    orders = turn_orders(kernel.model, curve.errors, kernel.torque)
    main = ", ".join(f"{order:g}: {amplitude / ARCSECOND:.2f}″" for order, amplitude, _ in orders.main(3))
    print(f"{label}: {main}")
    upper.plot(curve.carrier_angle / DEGREE, curve.transmission_error[0] / ARCSECOND, label=label)
    lower.plot(orders.order, orders.amplitude[0] / ARCSECOND, label=label)
upper.set(xlabel="carrier angle [°]", ylabel="transmission error [arcsec]", xlim=(0, 45))
lower.set(xlabel="order of the output turn", ylabel="amplitude [arcsec]")
upper.legend(loc="upper right")
plt.show()

# %%
# All errors at once, many units
# ------------------------------
# A linear sum of single errors fails, because pins change their contact. So random units are solved, each whole: from
# one uniform number per column to a deviation (the zones' quantiles), to the gap, to equilibrium, to the extremes of
# the curve.

generator = np.random.default_rng(1)
standard = errors.standard_values(generator.random((512, len(errors.columns))))
evaluation = model.reading((ta.PEAK_TO_PEAK,))(errors.deviations(standard, errors.zones))
peak = evaluation.values[evaluation.good, 0]
print(f"{peak.size} units: median {np.median(peak):.1f}″, 99 % below {np.quantile(peak, 0.99):.1f}″")
share = np.mean(peak <= 60)
print(f"share below 60″: {share:.1%} ± {np.sqrt(share * (1 - share) / peak.size):.1%}")

# %%
# The cost
# --------
# The row's cost holds at today's zone and falls as 1/zone. Half the zone costs twice as much; what it buys is asked
# on the same random units, so that their noise cancels.

halved = study.ask(ta.Difference(zones={"pin.diameter": zone / MICROMETRE / 2}, units=256), effort="quick")
print(*halved.sentences, sep="\n")

"""
Sorted pins of an RV-20E
========================

What the RV-20E's main study costs at the same limits, quick, seed 1, by how its pins are chosen: sorted to grooves in
classes, or taken in steps of 1 µm for the measured groove and disc profile. The numbers are those that
``studies/benchmarks/sorted_batches.py --reducer`` of version 0.1.0 printed in ten minutes; prices of assembly are
assumed.

**Read off it:** which way of choosing pins saves more in the zones than it costs at assembly.
"""

import matplotlib.pyplot as plt

measured = {
    "as they come": (101.42, 0.0),
    "2 classes": (98.32, 0.22),
    "4 classes": (98.32, 0.64),
    "3 sizes": (96.42, 0.40),
    "5 sizes": (94.59, 0.80),
}
zones, assembly = zip(*measured.values(), strict=True)
figure, axes = plt.subplots(figsize=(8, 3.5), constrained_layout=True)
axes.barh(list(measured), zones, label="zones")
axes.barh(list(measured), assembly, left=zones, label="assembly")
axes.invert_yaxis()
axes.set(xlim=(90, 103), xlabel="cost [cost units], from 90 on")
axes.legend()
plt.show()

"""Compiled functions of the cycloid stage, and the numbers by which they know the contact laws."""

LINEAR, LOGARITHMIC = 0, 1
LAWS = {"constant": LINEAR, "table2": LINEAR, "logarithmic": LOGARITHMIC}
"""Law of each `Stiffness.pin_contact_law`; the linear ones differ in their stiffness along the tooth only."""

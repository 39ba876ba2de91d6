"""Arbeitsmappe eines Büros: Titel, Passungen, ±, eine Summe, zwei gleiche Bolzen in einer Zeile."""

import tolalloc as ta


def überstand(platte, bolzen1, bolzen2, buchse):
    return platte - (bolzen1 + bolzen2) / 2 - buchse


study = ta.Study(
    ta.model(überstand, inputs=("platte", "bolzen1", "bolzen2", "buchse"), outputs=("Überstand [mm]",)),
    ta.drawing("mappe.xlsx"),
    limits={"Überstand [mm]": ta.Limit(lower=1.9, upper=2.15)},
    name="buero_xlsx",
)

"""Toleranzkette eines Büros: Strichpunkte, Dezimalkommas, Windows-Zeichen, eigene Köpfe."""

import tolalloc as ta


def spiel(gehäuse, welle, scheibe):
    return gehäuse - welle - scheibe


study = ta.Study(
    ta.model(spiel, inputs=("gehäuse", "welle", "scheibe"), outputs=("Spiel [mm]",)),
    ta.drawing("kette.csv"),
    limits={"Spiel [mm]": ta.Limit(lower=0.15, upper=0.45)},
    name="buero_csv",
)

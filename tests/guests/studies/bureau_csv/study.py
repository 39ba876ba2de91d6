"""Chaîne de cotes d'un bureau d'études."""

import tolalloc as ta

study = ta.Study(
    ta.model(lambda carter, arbre: carter - arbre, inputs=("carter", "arbre"), outputs=("jeu [mm]",), name="jeu"),
    ta.drawing(
        "cotes.csv",
        columns={
            "Caractéristique": "id",
            "Genre": "feature",
            "Cote nominale": "nominal",
            "Écart supérieur": "plus",
            "Écart inférieur": "minus",
            "Unité": "unit",
            "mini": "min",
            "maxi": "max",
            "Coût": "cost",
            "Loi": "distribution",
        },
    ),
    limits={"jeu [mm]": ta.Limit(lower=0.1, upper=0.5)},
    name="bureau_csv",
)

"""Error sources: tolerance tables, and the way from a drawing's zone to random columns.

`drawing.load_drawing` reads a table with its correlations and costs into a `Drawing`; `fields` is the one list of its
columns. `error_model.ErrorModel` turns random numbers into deviations: `zones` maps a zone to them, `distributions`
has their laws, `compensators` and `sorting` choose at assembly. `seeds.SeedTree` is where every random number hangs.
"""

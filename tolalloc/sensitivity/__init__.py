"""What drives an output: indices with the confidence of their ranking, and the measures beside them.

`measures.rank` answers what drives the outputs of a model: `sobol` grows a design of `saltelli` until `ranking` is
sure of the order, `shapley` shares what is correlated, `target` asks the rejected units, `inverse` opens each zone
alone. `effort.RankingEffort` says how much is computed, `result.RankingResult` holds it all.
"""

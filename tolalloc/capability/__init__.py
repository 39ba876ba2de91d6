"""How many units keep a limit: random units, capability indices, and the rare units beyond a limit.

`monte_carlo` draws random units and says how sure a yield is; `indices` has limits, Cp and Cpk with their intervals.
`yield_at_limit` asks `rare_failure` where a rejected unit is rare, `near_limit` solves the units near a limit alone,
`linear_function` gives exact shares of what is linear, `worst_unit` searches the worst one inside all zones.
"""

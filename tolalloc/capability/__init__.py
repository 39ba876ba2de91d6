"""How many units keep a limit: random units, capability indices, and the rare units beyond a limit."""

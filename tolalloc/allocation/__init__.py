"""What to decide: zones and tooth modification at the lowest cost for a limit, verified on the real model.

`drawing_question` asks in order: `space` (what may be chosen, what must be shown), `cost`, `search` (convex programs,
processes and grades, verified steps), `verify` (random units of the real model), `front` (what else can be had).
`result.AllocationResult` is the answer; `difference` compares two drawings on the same units.
"""

"""Whether a design is accepted: random units on the real model, most of them near a limit."""

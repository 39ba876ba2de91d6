"""The live page: what if, asked of a study by moving a slider, on the model and the units of every command."""

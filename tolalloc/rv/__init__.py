"""The RV reducer: one model of this package, and its own tools."""

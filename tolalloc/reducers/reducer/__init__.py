"""The nominal reducer: geometry, stiffness formulas, load, and the files that hold them."""

"""The mathematical programs of allocation: features with a choice of processes, tolerance stacks, certificates."""

"""How work runs: chunks, workers, the cache of solved units, progress, compiled kernels."""

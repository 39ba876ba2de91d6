"""How work runs: chunks, workers, the cache of solved units, progress, compiled kernels.

`chunks.Mapper` is the one interface of whatever solves samples; `workers` is one behind it, on a Dask scheduler.
`result_cache` keeps solved units in files; `progress.RunRecord` counts statuses and times; `compiled` compiles
kernels.
"""

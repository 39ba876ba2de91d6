"""The Pareto front of cost against whatever is traded for it, by NSGA on a problem of real and integer genes."""

from tolalloc.allocation.pareto.front import Front, pareto_front
from tolalloc.allocation.pareto.problem import from_genes, to_genes

__all__ = ["Front", "from_genes", "pareto_front", "to_genes"]

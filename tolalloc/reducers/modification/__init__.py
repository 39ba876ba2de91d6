"""How to choose the two modification amounts: problems of the sources, and a search that is sure of its optimum."""

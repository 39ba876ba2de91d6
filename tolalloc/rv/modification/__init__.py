"""How to choose the two modification amounts: problems of the sources, a sure reference, and evolutionary searches."""

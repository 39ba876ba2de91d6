"""How angular errors of parts build up along datum flow chains, and the adjustment that takes most of them out."""

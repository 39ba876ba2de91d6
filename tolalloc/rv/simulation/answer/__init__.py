"""Reports on a reducer in motion: what it does over time, and what of that is not there at rest."""

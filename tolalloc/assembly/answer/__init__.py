"""Reports on assemblies: what is turned at every step, what it leaves, and what angular tolerances cost then."""

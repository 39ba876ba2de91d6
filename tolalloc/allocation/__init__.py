"""What to decide: zones and tooth modification at the lowest cost for a limit, verified on the real model."""

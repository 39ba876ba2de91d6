"""What else can be had at which cost: the front, the worth of settings and yields, robustness."""

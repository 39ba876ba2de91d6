"""What else can be had at which cost: Pareto fronts, the worth of settings and yields, robustness."""

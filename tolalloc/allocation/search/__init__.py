"""How a design is found: convex programs, the choice of processes and grades with certificates, verified steps."""

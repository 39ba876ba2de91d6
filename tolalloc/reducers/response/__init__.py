"""What the equivalent model answers to columns of random units: outputs, statuses and derivatives."""

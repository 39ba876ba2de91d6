"""The report on what a measured curve tells of the parts of its unit."""

"""What a test bench reads: measured data, identified stiffnesses, diagnosed units."""

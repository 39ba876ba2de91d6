"""What a test bench and gauges read: measured data, identified stiffnesses, diagnosed units, lots."""

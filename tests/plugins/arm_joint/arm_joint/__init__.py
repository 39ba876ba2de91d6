"""An RV reducer whose output flange also turns in a bearing of the robot's arm: a package beside tolalloc."""

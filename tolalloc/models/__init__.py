"""What is asked: models, their settings, own functions."""

"""What the modified teeth do without errors, and the profile for a drawing."""

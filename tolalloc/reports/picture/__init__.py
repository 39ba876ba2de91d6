"""The moving picture of a reducer: its arrays in JSON, its place in a page, and the same picture drawn still."""

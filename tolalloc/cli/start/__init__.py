"""The way in: a folder with a reducer, a tolerance table, a study and samples that run at once."""

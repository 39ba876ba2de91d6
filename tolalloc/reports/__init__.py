"""Tables, figures, Excel and HTML from the results of a study."""

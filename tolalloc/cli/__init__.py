"""The commands: words in, an answer out.

`main` lists the commands; those without a study are made from their records (`inquiries`). `console` prints, `start`
makes a new folder, `live` is the page on which sliders move.
"""

"""A study with its questions, what runs them, and the folder of a run.

`study.Study` is a `problem.Problem` with `questions`; `prepared.Prepared` has its files read and its names matched,
and `answer.Answer` is what comes out. `inquiry.Inquiry` is a question without a study, `wing.Wing` what a wing
brings.
"""

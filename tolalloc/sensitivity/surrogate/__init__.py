"""Fast surrogates of a response, their errors measured on unseen answers, and the cheap model under Sobol indices."""

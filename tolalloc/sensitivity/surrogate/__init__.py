"""Fast surrogates of a response, each with its error measured on answers it has not seen."""

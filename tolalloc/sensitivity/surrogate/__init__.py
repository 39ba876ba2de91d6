"""Fast stand-ins for a response, each with its error measured on answers it has not seen."""

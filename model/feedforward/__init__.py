"""Set points that make the arm follow a motion: from a model of it, or from a record of the last attempt."""

"""Finding out, on a machine that nobody knows yet, what its files only assume. Pure: readings in, verdicts out."""

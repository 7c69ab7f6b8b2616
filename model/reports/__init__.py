"""Typed results as HTML pages: each a list of sections, rendered into one file that needs nothing else."""

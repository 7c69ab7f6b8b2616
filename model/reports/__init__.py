"""Renders typed results as HTML pages: each is a list of sections in one self-contained file."""

"""Reproduction of the source: its published tables as data, and this model's results beside them."""

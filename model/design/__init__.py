"""Experiments that make chosen parameters best known, and what a proposed experiment would add."""

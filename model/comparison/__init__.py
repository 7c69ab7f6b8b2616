"""Comparison of models with measurements: simulated traces, their residuals, and how large these are."""

"""Sensitivity analysis: which parameter changes which joint's motion, and when."""

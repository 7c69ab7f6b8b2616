"""Estimates parameters of a model from traces: bounded robust least squares, exact Jacobians, priors and intervals."""

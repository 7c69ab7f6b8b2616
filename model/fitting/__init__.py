"""Parameters of a model from traces: bounded robust least squares with exact Jacobians, priors and honest intervals."""

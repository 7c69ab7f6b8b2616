"""Metrics of the service, and the check whether it is ready to take experiments."""

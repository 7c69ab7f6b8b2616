"""The configuration: which robot, on which port, with which limits, where traces go."""

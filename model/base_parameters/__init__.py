"""Base parameters: the fewest combinations of masses, moments and friction that determine an arm's torques."""

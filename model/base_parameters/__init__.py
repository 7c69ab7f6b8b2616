"""Base parameters: the fewest combinations of masses, moments and friction on which an arm's torques depend."""

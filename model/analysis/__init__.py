"""What a model says about its machine: torques along a motion, elements of D, sensitivities, which parameters act."""

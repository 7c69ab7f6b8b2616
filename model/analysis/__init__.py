"""Analysis of a model: torques along a motion, elements of D, sensitivities, and the joints that parameters act on."""

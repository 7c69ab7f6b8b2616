"""Where simulation and measurement disagree: by joint, time, phase of motion, and what the residual depends on."""

"""The search for missing effects, whatever is compared: torques along the motion, or readings of the closed loop."""

"""How much of the record the simulated controller is given (docs/decisions/0020)."""

FOLLOWING = 0.8
"""Share of the way to the recorded reading that the simulated controller is given where models are fitted and
compared. More finds less, for the laws of an arm are never exactly a model's, and a torque that is a little wrong adds
up; with less, what noise has moved looks like torque."""
FOLLOWING_FOR_ERRORS = 0.5
"""The same where errors are told and judged, held-out ones above all: nearer to what the model alone would do."""

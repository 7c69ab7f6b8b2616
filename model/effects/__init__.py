"""Physical effects by name: their parameters, where they act, the physics in one line, and its source."""

"""One robot as the service holds it: its owner's process, its state, who may move it, and its stop."""

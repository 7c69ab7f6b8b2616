"""One robot in the service: the process that owns its port, its state, who may move it, and its stop."""

"""Live data for clients: one hub a robot, one outbox a client, and a ring buffer of the last minutes."""

"""Live data for clients: a hub for each robot, an outbox for each client, and a ring buffer of the last minutes."""

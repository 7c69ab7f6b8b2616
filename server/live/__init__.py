"""What is happening, to whoever watches: one hub a robot, one queue a client, and a ring of the last minutes."""

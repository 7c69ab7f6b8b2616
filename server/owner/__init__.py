"""The process that owns a connected robot's port while the robot is connected: `python -m server.owner`.

It watches the arm while nothing moves, runs experiments and teaching on the same connection, writes the traces, and
always listens on its own stop socket. It imports nothing of the web server. "The owner" below is this process.
"""

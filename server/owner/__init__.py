"""The process that owns a connected robot's port for as long as it is connected: `python -m server.owner`.

It watches the arm while nothing moves, runs experiments and teaching on the same connection, writes the traces, and
always listens on its own stop socket. It imports nothing of the web server.
"""

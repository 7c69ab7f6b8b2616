"""The process that owns a connected robot's port for as long as it is connected: `python -m server.owner`.

It watches the arm while nothing moves, runs experiments and teaching on the same connection, writes the traces, and
listens on its own stop socket all the time. Nothing of the web server is imported here.
"""

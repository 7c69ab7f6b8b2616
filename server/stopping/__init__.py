"""The stop listener: a process that has nothing else to do, beside the service: `python -m server.stopping`.

It answers stops at a port of its own, by the stop socket of the process that owns the robot's port, and looks at tokens
by itself: a service that hangs, or has been put aside by the operating system, is not needed for any of it. Neither the
web framework nor the database's is imported here: it is there before the service is.
"""

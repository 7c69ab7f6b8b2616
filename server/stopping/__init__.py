"""The stop listener: a process beside the service with only this task: `python -m server.stopping`.

It accepts stops at its own port, and passes them to the stop socket of the process that owns the robot's port. It
checks tokens itself. So it works even if the service hangs or is suspended by the operating system. It imports neither
the web framework nor the database library, so it is ready before the service.
"""

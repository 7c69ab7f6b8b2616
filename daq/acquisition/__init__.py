"""The acquisition process: owner of the port, writer of the trace, listener for stop."""

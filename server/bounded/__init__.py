"""Processes with limits of memory and time, for what others send: whatever it does to them, the service goes on."""

"""Processes with limits of memory and time, which handle untrusted input so that it cannot harm the service."""

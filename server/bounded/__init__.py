"""Processes with limited memory and time, which handle untrusted input so that it cannot harm the service."""

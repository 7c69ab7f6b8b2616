"""Errors that a user meets: one clear line each, saying what is wrong, where, and what is allowed."""


class DaqError(Exception):
    """Base of every error that is the user's to see; its text is one line."""


class SpecError(DaqError):
    """An experiment, machine or configuration that cannot be carried out as written."""


class TraceError(DaqError):
    """A trace that cannot be what it claims to be."""

"""A robot at this computer's port, or at a service."""

"""Notifications by webhook and e-mail, from an outbox in the database that survives a restart."""

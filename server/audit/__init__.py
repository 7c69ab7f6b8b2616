"""The audit log: rows that nobody can change through the service, each chained to the one before it."""

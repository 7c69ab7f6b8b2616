"""Backup and restore of everything that a service keeps, as one file: database, traces, models, results of jobs."""

"""Everything that a service keeps, in one file, and back: database, traces, models, results of jobs."""

"""`daq teach`: jogging, leading by hand, steps and programs; programs edited off line, and kept by a service."""

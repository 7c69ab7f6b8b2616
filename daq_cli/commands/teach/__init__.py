"""`daq teach`: jogging, hand guiding, steps and programs. Programs are edited offline and stored by a service."""

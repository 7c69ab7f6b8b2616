"""The queue of one robot: it runs experiments one at a time, and pauses when a person must look first."""

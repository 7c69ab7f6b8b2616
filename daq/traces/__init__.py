"""Trace files: MCAP written so that a crash loses a second at most, read into numpy, listed, checked, drawn, as CSV."""

"""Trace files: MCAP, written so that a crash loses at most a second; reading, listing, checking, plotting, and CSV."""

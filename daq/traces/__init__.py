"""Trace files: written as MCAP so that a crash loses about a second; reads, lists, checks and plots them; CSV."""

"""Models beside what was measured: simulated traces, what is left of them, and how large that is."""

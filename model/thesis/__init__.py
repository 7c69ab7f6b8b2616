"""The source's published tables as data, and what this model makes of them: ours beside the published."""

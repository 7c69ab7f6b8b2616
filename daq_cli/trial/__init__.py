"""The blind trial of `daq blind`: its stages, each in a process of its own, and the data between them."""

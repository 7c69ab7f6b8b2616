"""The blind trial of `daq blind`: each stage a process of its own, and what passes between them."""

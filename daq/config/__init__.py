"""The configuration: robots, ports, limits, and the folder of traces."""

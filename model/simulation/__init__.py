"""Motion of a model: in closed loop from recorded set points, and in open loop from recorded drive."""

"""Motion of a model: in closed loop from recorded set points, in open loop from recorded drive, and in torque space."""

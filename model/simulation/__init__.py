"""Simulates a model: in closed loop from recorded set points, or in open loop from recorded drive."""

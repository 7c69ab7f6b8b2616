"""The output-error method: the closed loop is simulated, and measured less simulated positions are compared."""

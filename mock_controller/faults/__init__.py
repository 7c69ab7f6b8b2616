"""Faults on demand, by name: of the line, of the shared memory, of the arm and its sensors, of the supply."""

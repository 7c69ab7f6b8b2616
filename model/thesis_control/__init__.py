"""Control laws on the arm of chapter 8 in continuous time: partitioned (computed torque) and classical PID."""

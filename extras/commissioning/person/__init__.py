"""Access to the arm, and communication with the person beside it."""

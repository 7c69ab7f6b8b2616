"""The queue of one robot: pure rules (states, order, schedule), and what carries them out."""

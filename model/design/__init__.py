"""Designs experiments that determine chosen parameters best, and predicts the gain of proposed ones."""

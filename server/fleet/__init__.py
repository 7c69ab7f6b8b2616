"""What several robots of one service have in common: comparison of their fits over time."""

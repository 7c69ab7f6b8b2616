"""Validation by distortion (chapter 4): how far parameters would have to move to explain what a model misses."""

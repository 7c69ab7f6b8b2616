"""What the data can tell: which parameters are known, which only in combination, and which not at all."""

"""What the steps do with an arm, and with the person beside it."""

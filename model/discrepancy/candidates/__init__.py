"""What could explain a disagreement: the library's effects on every joint, probed and ranked."""

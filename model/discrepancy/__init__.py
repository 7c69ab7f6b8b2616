"""Where simulation and measurement disagree, which physical effect is missing, and what adding it brings."""

"""Common parts of the model commands: their input, their tables, and the text of a diagnosis."""

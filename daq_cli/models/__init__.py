"""What the commands on models share: their input, their tables, and the text of a diagnosis."""

"""What the commands about models share: their input, their tables, and the words of a diagnosis."""

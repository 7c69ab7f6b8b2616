"""The traces of the folder, in the catalogue: what lies there is the truth, the table finds it."""

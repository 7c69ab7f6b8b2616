"""The catalogue of the traces in the folder. The files are authoritative; the table makes them searchable."""

"""Finds the registers in the memory that the controller shares with its host, from readings alone.

`recording` keeps readings by the action during them; `bytes`, `relations` and `joint` find candidates for each byte;
`findings` gives the verdicts. `procedure` and `commands` state what a person does, and what may be written.
"""

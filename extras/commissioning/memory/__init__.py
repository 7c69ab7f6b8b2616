"""What lies where in the memory that the controller shares with its host, from readings of it alone.

`recording` keeps readings by what was done meanwhile; `bytes`, `relations` and `joint` say what a byte could be;
`findings` gives the verdicts. `procedure` and `commands` are the way there: what a person does, and what may be
written.
"""

"""Arms with secrets: tolerances and effects are drawn from a seed, hidden during the diagnosis, revealed afterwards.

`tolerances` says how far a sound arm may be from its data file, `sizes` how large a hidden effect may be, `arm` draws
both from a seed. `closed_loop` and `separation` compute, without any diagnosis, how well an effect can be seen.
"""

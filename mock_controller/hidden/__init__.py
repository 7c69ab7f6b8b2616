"""Arms that keep a secret: tolerances and effects drawn from a seed, told to nobody, revealed afterwards.

`tolerances` says how far a sound arm may be from its data file, `sizes` how large a hidden effect may be, `arm` draws
both from a seed. `closed_loop` and `separation` compute, without any diagnosis, how well an effect can be seen.
"""

"""Arms with secrets: a seed draws tolerances and effects, which stay hidden during the diagnosis and are revealed
afterwards.

`tolerances` states how far a healthy arm may differ from its data file, `sizes` how large a hidden effect may be; `arm`
draws both from a seed. `closed_loop` and `separation` compute, without any diagnosis, how well an effect can be seen.
"""

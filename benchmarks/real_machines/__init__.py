"""Records of real machines that others published, and the diagnosis' answers on them.

The data are not part of this repository: `rigs.toml` has repository, commit and licence of each, and the mapping of
columns. The machine files beside it are written as the rig's own lab would write them from data sheets.
"""

"""Records of real machines that others made and published: what the method in torques says of them.

The data are not part of this repository. Each has a source, a commit and a licence, told in `sources.py`; the machine
files beside it are written as the rig's own lab would write them from data sheets.
"""

"""A developer's step: derive the closed-form dynamics with SymPy and write them as a module.

`python -m model.generation` writes `model/dynamics/three_joint.py`; with `--check` it only says whether that file
still belongs to the sources it was made from.
"""

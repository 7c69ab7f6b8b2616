"""A developer's step: `python -m model.generation` derives the closed-form dynamics with SymPy, and writes them as
`model/dynamics/three_joint.py`.
"""

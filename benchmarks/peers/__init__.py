"""What other programs answer to the same question on the same data, each in an environment of its own.

Nothing of them is a requirement. A script `…_side.py` here imports one of them and nothing of this project; it is run
by the Python of an environment that has the program, reads its task as JSON or NPZ, and prints JSON.
"""

"""The process that owns a robot's port: `python -m daq.owner`. "The owner" is this process.

The service keeps one for each connected robot; the command line and `ma2000` start one on demand. It carries out
orders, writes the traces of runs, and always listens on its own stop socket.
"""

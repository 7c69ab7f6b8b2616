import os

os.environ.setdefault("MUJOCO_GL", "disable")
"""Turns off MuJoCo's graphics: the mock draws nothing, and loading the library for windows takes a sixth of its
start."""

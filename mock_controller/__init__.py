import os

os.environ.setdefault("MUJOCO_GL", "disable")
"""Nothing is drawn here. Else MuJoCo loads a library for windows when it is imported, a sixth of the mock's start."""

"""Small machines for the tests: one joint each, described as a user would in a file."""

from daq.contracts.machine import Machine, parse_machine

PENDULUM = """
version = 1
name = "pendulum"
title = "A rod on a horizontal axis, driven by a torque"
gravity = [0.0, -9.81, 0.0]
modelled_joints = [1]
[controller]
kind = "none"
[[joints]]
name = "axis"
kind = "revolute"
[joints.geometry]
a = { value = 0.5, unit = "m", source = "test" }
alpha = { value = 0.0, unit = "rad", source = "test" }
d = { value = 0.0, unit = "m", source = "test" }
theta = { value = 0.0, unit = "rad", source = "test" }
[joints.link]
shape = "rod"
mass = { value = 1.2, unit = "kg", source = "test" }
[joints.drive]
kind = "gain"
gain = { value = 1.0, unit = "N·m", source = "test" }
"""

SLIDE = """
version = 1
name = "slide"
title = "A carriage on a level slide, with a sampled cascade"
gravity = [0.0, -9.81, 0.0]
modelled_joints = [1]
[controller]
kind = "pid"
period = { value = 0.01, unit = "s", source = "test" }
delay = { value = 0.0, unit = "s", source = "test" }
gains = [[4.0, 0.0, 0.0]]
velocity_gains = [[40.0, 0.0, 0.0]]
[[joints]]
name = "carriage"
kind = "prismatic"
[joints.geometry]
a = { value = 0.0, unit = "m", source = "test" }
alpha = { value = 0.0, unit = "rad", source = "test" }
d = { value = 0.0, unit = "m", source = "test" }
theta = { value = 0.0, unit = "rad", source = "test" }
[joints.link]
shape = "rod"
mass = { value = 2.0, unit = "kg", source = "test" }
[joints.drive]
kind = "gain"
gain = { value = 1.5, unit = "N", source = "test" }
inertia = { value = 0.5, unit = "kg·m²", source = "test: mass of the drive" }
[joints.sensor]
bits = 16
range = { value = 1.0, unit = "m", source = "test" }
at_zero = { value = -0.5, unit = "m", source = "test" }
"""


def pendulum() -> Machine:
    """A rod of 0.5 m and 1.2 kg that swings about a horizontal axis; its angle is measured from the horizontal."""
    return parse_machine(PENDULUM)


def slide() -> Machine:
    """A carriage of 2 kg with a drive of 0.5 kg, position and speed loops."""
    return parse_machine(SLIDE)

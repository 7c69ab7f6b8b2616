"""Fitting where the drive's torque is recorded: the torque that a motion needs against the torque that was there.

It needs no simulation, so it also serves a motion that no simulation follows for long, such as an unstable one without
a controller. In return it needs accelerations, which noise spoils: positions are low-passed, and torque alike.
"""

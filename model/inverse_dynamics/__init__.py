"""Inverse dynamics along a recorded motion: the torque that it needs, less the torque that was supplied.

Nothing is simulated, so it also serves a machine whose controller is unknown, and a motion that no simulation follows
for long, such as an unstable one without a controller. In return it needs accelerations, which noise spoils: motion and
torques are low-passed alike.
"""

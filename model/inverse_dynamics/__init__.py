"""Inverse dynamics along a recorded motion: the torque that it needs − the torque that was applied.

Nothing is simulated. So it also serves a machine with an unknown controller, and a motion that no simulation follows
for long, such as an unstable one without a controller. But it needs accelerations, which are noisy; motion and torques
are therefore low-passed alike.
"""

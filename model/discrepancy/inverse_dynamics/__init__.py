"""Diagnosis without a simulation: which effects explain the residual torques of `model.inverse_dynamics`.

For rigs whose controller is unknown, and motions that no simulation follows for long. The torque that the motion needs
less the torque that drive and friction supply is the residual; an effect is a torque that explains it.
"""

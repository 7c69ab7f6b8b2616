"""Diagnosis without a simulation: recorded drive and measured motion, compared as torques.

For rigs without a known controller, and motions that no simulation follows for long. The torque that the motion needs
(inverse dynamics) less the torque that drive and friction supply is the residual; an effect is a torque that explains
it.
"""

"""Calibrates controller and sensors. Pure: arrays and traces in, estimates out."""

from daq.calibration.gain import GainEstimate, NoEstimate, estimate_gain, gains_from_trace
from daq.calibration.gain_experiment import gain_experiment

__all__ = ["GainEstimate", "NoEstimate", "estimate_gain", "gain_experiment", "gains_from_trace"]

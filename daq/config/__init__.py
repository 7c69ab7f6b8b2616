"""The configuration: which robot, on which port, with which limits, where traces go."""

from daq.config.settings import Settings, config_files, load_settings

__all__ = ["Settings", "config_files", "load_settings"]

"""Optional extensions. Each package here describes in its `__init__` what it adds to the core (daq/plugins.py); the
core imports none of them."""

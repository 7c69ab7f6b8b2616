"""From a set point to motor volts, for one joint and one period: sensor, controller, amplifier; compiled."""

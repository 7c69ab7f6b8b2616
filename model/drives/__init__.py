"""From a set point to motor volts, a period at a time: sensor, controller, amplifier; compiled, one joint a call."""

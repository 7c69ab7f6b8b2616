"""A bench of Dynamixel servos without the servos: a pan-tilt head on one bus, reached through a port like a real
one."""

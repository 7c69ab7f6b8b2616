"""Dynamixel servos on one bus: ROBOTIS' Protocol 2.0, the X series' control table, and the dialect that drives them.

Written from the maker's public manual (emanual.robotis.com: DYNAMIXEL Protocol 2.0, XM430-W350). Pure, as all of
`firmware_protocol`.
"""

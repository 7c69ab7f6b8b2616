"""Imports tables of other programs as traces: finds the name, unit and joint of each column."""

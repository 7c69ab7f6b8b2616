"""Tables of other programs as traces: what their columns are called, in which unit, and which joint each is of."""

"""`daq commission`: the first day with an arm."""

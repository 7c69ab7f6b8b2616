"""Plans motions as set points for every control period. Pure: nothing here moves an arm."""

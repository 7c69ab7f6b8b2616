"""A diagnosis by output error: effects are selected one after the other, each tested on held-out traces."""

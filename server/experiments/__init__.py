"""Pure rules of experiments: states, order in the queue, endings, least duration, and times of scheduled runs."""

"""Pure rules of experiments: states, order in the queue, endings, least length, and when a schedule submits."""

"""The blind trial: scores answers of the diagnosis against the effects hidden in arms. Pure: no files, no mock."""

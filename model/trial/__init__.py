"""The blind trial: answers of the diagnosis beside what arms had hidden. Pure: no files, no mock."""

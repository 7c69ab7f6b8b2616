"""`python -m daq.owner`."""

import gc

gc.disable()  # collections would take a third of the imports' time, and find nothing

from daq.owner.process import main  # noqa: E402 - after that

gc.enable()

raise SystemExit(main())

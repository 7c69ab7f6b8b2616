"""`python -m daq.owner`."""

import gc

gc.disable()  # garbage collection would take a third of the import time, and find nothing

from daq.owner.process import main  # noqa: E402 - imported after gc.disable()

gc.enable()

raise SystemExit(main())

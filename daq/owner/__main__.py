"""`python -m daq.owner`."""

import gc

gc.disable()  # garbage collection would take a third of the import time, and find nothing

from daq.owner.process import main  # noqa: E402 - imported after gc.disable()

gc.freeze()  # nor would later ones, nor the one at the end
gc.enable()

raise SystemExit(main())

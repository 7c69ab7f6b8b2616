"""`python -m server.stopping`."""

import gc

gc.disable()  # garbage collection would take half of the import time; `keep_steady` enables it

from server.stopping.process import main  # noqa: E402 - imported after gc.disable()

raise SystemExit(main())

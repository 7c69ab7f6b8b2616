"""`python -m server.stopping`."""

import gc

gc.disable()  # collections would take half of the imports' time, and find nothing; `keep_steady` lets them begin

from server.stopping.process import main  # noqa: E402 - after that

raise SystemExit(main())

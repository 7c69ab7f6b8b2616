"""`python -m server.stopping`."""

from server.stopping.process import main

raise SystemExit(main())

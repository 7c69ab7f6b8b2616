"""`python -m server.owner`."""

from server.owner.process import main

raise SystemExit(main())

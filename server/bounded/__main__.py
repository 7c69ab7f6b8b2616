"""`python -m server.bounded`."""

from server.bounded.process import main

raise SystemExit(main())

"""`python -m daq.owner`."""

from daq.owner.process import main

raise SystemExit(main())

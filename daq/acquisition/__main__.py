"""`python -m daq.acquisition`."""

from daq.acquisition.process import main

raise SystemExit(main())

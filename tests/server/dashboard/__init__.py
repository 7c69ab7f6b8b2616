"""The dashboard in a real browser. A package, unlike the other folders of tests: only then do its fixtures of package
scope end with its last test, and with them Playwright's event loop, beside which no other can run in this thread."""

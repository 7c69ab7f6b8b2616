"""A package, unlike the other folders of tests: only then do its fixtures of package scope end with its last test. The
services and their mock, which nobody needs any longer, would take a third of a processor until all tests are over."""

"""What the site does beyond Sphinx: pages made from the code, checks, and files that a strict policy allows."""

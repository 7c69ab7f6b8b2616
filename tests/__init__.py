"""A package, so that `tests/server`, which is one too, is not taken for the product's package of that name."""

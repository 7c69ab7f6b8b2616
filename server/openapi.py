"""`python -m server.openapi` prints the API's OpenAPI description, from which the page's types are generated."""

from __future__ import annotations

import json
import sys

from server.app import bare_app


def main() -> None:
    """Writes the description as one JSON document to standard output."""
    json.dump(bare_app(None).openapi(), sys.stdout, indent=1, ensure_ascii=False)
    sys.stdout.write("\n")


if __name__ == "__main__":
    main()

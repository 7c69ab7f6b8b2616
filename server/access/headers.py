"""What browsers are told about every answer: run and show nothing that does not come from here."""

from __future__ import annotations

from starlette.datastructures import MutableHeaders

SECURITY = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; "
    "font-src 'self'; connect-src 'self'; manifest-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), geolocation=(), microphone=()",
}
API_PREFIX = "/api/"


def secure(headers: MutableHeaders, path: str) -> None:
    """Adds them. Answers of the API are not kept by anybody on the way."""
    for name, value in SECURITY.items():
        headers.setdefault(name, value)
    if path.startswith(API_PREFIX) and "cache-control" not in headers:
        headers["Cache-Control"] = "no-store"

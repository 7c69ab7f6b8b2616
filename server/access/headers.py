"""Security headers of every response: browsers then run and show only what this service has sent."""

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
POLICY, CONNECT = "Content-Security-Policy", "connect-src 'self'"
API_PREFIX = "/api/"


def secure(headers: MutableHeaders, path: str, stop_listener: str | None = None) -> None:
    """Adds the security headers, and forbids caches to store responses of the API. `stop_listener`: a second origin, at
    which the page may request a stop."""
    for name, value in SECURITY.items():
        headers.setdefault(name, value)
    if stop_listener is not None and headers[POLICY] == SECURITY[POLICY]:
        headers[POLICY] = SECURITY[POLICY].replace(CONNECT, f"{CONNECT} {stop_listener}")
    if path.startswith(API_PREFIX) and "cache-control" not in headers:
        headers["Cache-Control"] = "no-store"

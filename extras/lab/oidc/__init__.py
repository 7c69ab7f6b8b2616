"""Signing in: people come to the page by an account at a provider of OpenID Connect; programs keep tokens."""

from daq.plugins import Plugin

PLUGIN = Plugin(
    settings={"oidc": "extras.lab.oidc.settings:OidcSettings"},
    checks=("extras.lab.oidc.settings:check",),
    migrations={"people": "extras.lab.oidc.versions"},
    parts=("extras.lab.oidc.routes:SigningIn",),
    routes=("extras.lab.oidc.routes:router",),
)

"""Sign-in: people use an account at an OpenID Connect provider; programs keep using tokens."""

from daq.plugins import Plugin

PLUGIN = Plugin(
    settings={"oidc": "extras.lab.oidc.settings:OidcSettings"},
    checks=("extras.lab.oidc.settings:check",),
    migrations={"people": "extras.lab.oidc.versions"},
    parts=("extras.lab.oidc.routes:SigningIn",),
    routes=("extras.lab.oidc.routes:router",),
)

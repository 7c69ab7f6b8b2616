"""Client of an OpenID Connect provider: authorization code with PKCE, state and nonce, by Authlib.

Sources: OpenID Connect Core 1.0 (section 3.1), Discovery 1.0 (section 4), RP-Initiated Logout 1.0; RFC 7636 (PKCE), RFC
9207 (the issuer in the answer). The service needs the provider only for sign-in: if it fails, people who have signed
in, and tokens, are not affected.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from typing import Any

import httpx
from authlib.common.errors import AuthlibBaseError
from authlib.common.urls import add_params_to_uri
from authlib.integrations.httpx_client import AsyncOAuth2Client
from authlib.oidc.core import CodeIDToken
from authlib.oidc.discovery import get_well_known_url
from joserfc import jwt
from joserfc.errors import JoseError
from joserfc.jwk import KeySet
from joserfc.jws import JWSRegistry

from daq.contracts.errors import SpecError
from daq.contracts.service.queue import ROLES
from extras.lab.oidc.people import Person
from extras.lab.oidc.settings import OidcSettings
from extras.lab.oidc.sign_in import Asked
from server.problems import ProblemError

ANSWER_WITHIN = 10.0
"""Time (s) for each answer of the provider."""
LEEWAY = 60
"""Time (s) by which the provider's clock may differ from this computer's: an assumption."""
ALGORITHMS = ["RS256", "RS384", "RS512", "PS256", "PS384", "PS512", "ES256", "ES384", "ES512", "EdDSA"]
"""Accepted signatures: only those whose keys are known to the provider alone."""
DISCOVERY_FOR = 3600.0
"""Time (s) after which the provider's endpoints are read again."""
CALLBACK = "/api/v1/login/callback"
log = logging.getLogger("server.access")


class Provider:
    """One provider. Its endpoints and keys are read when somebody first signs in. Use it on the event loop only."""

    def __init__(self, settings: OidcSettings, address: str, secret: str | None) -> None:
        assert settings.issuer is not None
        assert settings.client_id is not None
        self.issuer, self.client_id = settings.issuer, settings.client_id
        self.address = address.rstrip("/")
        self._settings = settings
        self._secret = secret
        self._found: dict[str, Any] = {}
        self._found_at = 0.0
        self._keys: KeySet | None = None

    async def ask(self, asked: Asked, now: float) -> str:
        """Returns the URL at the provider where a person signs in. Raises a 503.

        now: s, monotonic
        """
        endpoint = await self._endpoint("authorization_endpoint", now)
        async with self._client() as client:
            address, _ = client.create_authorization_url(
                endpoint, state=asked.state, nonce=asked.nonce, code_verifier=asked.verifier
            )
        return str(address)

    async def answered(self, asked: Asked, answer: Mapping[str, str], now: float) -> Person:
        """Returns the person who has signed in, from the parameters with which the provider sent them back.

        Raises a 403 for a rejected or invalid answer, and a 503 if the provider does not answer.
        """
        if answer.get("iss", self.issuer) != self.issuer:
            raise _not_proven("the answer is another provider's")
        if "error" in answer or "code" not in answer:
            raise ProblemError(403, "sign-in-refused", f"the provider refused: {answer.get('error', 'no code')!r:.100}")
        endpoint = await self._endpoint("token_endpoint", now)
        try:
            async with self._client() as client:
                token = await client.fetch_token(
                    endpoint, code=answer["code"], code_verifier=asked.verifier, grant_type="authorization_code"
                )
        except (httpx.HTTPError, ValueError) as error:
            raise _away(error) from error
        except AuthlibBaseError as error:
            raise ProblemError(403, "sign-in-refused", f"the provider refused the code: {error.error}") from error
        claims = await self._claims(token, asked.nonce, now)
        return person_of(claims, self._settings)

    async def sign_out_address(self, now: float) -> str | None:
        """Returns the URL that also ends the provider's session; None if the provider has none."""
        try:
            endpoint = (await self._discovered(now)).get("end_session_endpoint")
        except ProblemError:
            return None
        if not isinstance(endpoint, str):
            return None
        back = [("client_id", self.client_id), ("post_logout_redirect_uri", f"{self.address}/")]
        return str(add_params_to_uri(endpoint, back))

    async def _claims(self, token: Mapping[str, Any], nonce: str, now: float) -> Mapping[str, Any]:
        """Returns the claims of the ID token, after its signature, issuer, audience, times and nonce were checked."""
        encoded = token.get("id_token")
        if not isinstance(encoded, str):
            raise _not_proven("the provider gave no ID token")
        registry = JWSRegistry(algorithms=ALGORITHMS, strict_check_header=False)
        try:
            try:
                decoded = jwt.decode(encoded, key=await self._key_set(now), registry=registry)
            except (JoseError, ValueError):  # the provider may have a new key: once more with its present ones
                decoded = jwt.decode(encoded, key=await self._key_set(now, anew=True), registry=registry)
            claims = CodeIDToken(
                decoded.claims,
                decoded.header,
                {
                    "iss": {"essential": True, "value": self.issuer},
                    "aud": {"essential": True, "value": self.client_id},
                    "sub": {"essential": True},
                },
                {"nonce": nonce, "client_id": self.client_id, "access_token": token.get("access_token")},
            )
            claims.validate(leeway=LEEWAY)
        except (JoseError, ValueError, KeyError, TypeError) as error:
            raise _not_proven(f"the ID token is not valid: {error}") from error
        return dict(claims)

    async def _key_set(self, now: float, *, anew: bool = False) -> KeySet:
        if self._keys is None or anew:
            self._keys = KeySet.import_key_set(await self._json(await self._endpoint("jwks_uri", now)))  # type: ignore[arg-type]
        return self._keys

    async def _endpoint(self, name: str, now: float) -> str:
        found = (await self._discovered(now)).get(name)
        if not isinstance(found, str):
            raise _away(ValueError(f"it names no {name}"))
        return found

    async def _discovered(self, now: float) -> dict[str, Any]:
        if not self._found or now - self._found_at > DISCOVERY_FOR:
            found = await self._json(get_well_known_url(self.issuer, external=True))
            if found.get("issuer") != self.issuer:
                raise _away(ValueError(f"it calls itself {found.get('issuer')!r:.100}, not {self.issuer!r:.100}"))
            self._found, self._found_at = found, now
        return self._found

    async def _json(self, address: str) -> dict[str, Any]:
        try:
            async with httpx.AsyncClient(timeout=ANSWER_WITHIN) as client:
                answer = await client.get(address)
                answer.raise_for_status()
                found = answer.json()
        except (httpx.HTTPError, httpx.InvalidURL, ValueError) as error:
            raise _away(error) from error
        if not isinstance(found, dict):
            raise _away(ValueError("its answer is no object"))
        return found

    def _client(self) -> AsyncOAuth2Client:
        return AsyncOAuth2Client(
            client_id=self.client_id,
            client_secret=self._secret,
            token_endpoint_auth_method="none" if self._secret is None else "client_secret_basic",
            scope=" ".join(dict.fromkeys(("openid", *self._settings.scopes))),
            redirect_uri=self.address + CALLBACK,
            code_challenge_method="S256",
            timeout=ANSWER_WITHIN,
        )


def open_provider(settings: OidcSettings, address: str) -> Provider:
    """Returns the configured provider, without a request to it. `address`: URL of this service for browsers.

    Raises SpecError for a file of the secret that cannot be read.
    """
    secret = None
    if settings.client_secret is not None:
        try:
            secret = settings.client_secret.read_text("utf-8-sig").strip()
        except (OSError, UnicodeDecodeError) as error:
            # Without the value: a secret written there by mistake must not appear in a log.
            why = error.strerror if isinstance(error, OSError) else "it is not a text"
            raise SpecError(f"oidc.client_secret: names a file that cannot be read: {why}") from None
        if not secret:
            raise SpecError("oidc.client_secret: names a file that is empty")
    return Provider(settings, address, secret)


def person_of(claims: Mapping[str, Any], settings: OidcSettings) -> Person:
    """Returns the person in an ID token's claims. Raises a 403 without a usable name, or without a role."""
    name, given = claims.get(settings.name_claim), claims.get(settings.role_claim)
    if not isinstance(name, str) or not 1 <= len(name) <= 64 or not name.isprintable():
        line = f"the claim {settings.name_claim!r} has no name of 1 to 64 printable characters"
        raise ProblemError(403, "no-name", line, "choose another claim: oidc.name_claim")
    groups = [given] if isinstance(given, str) else given if isinstance(given, list) else []
    held = {settings.roles[group] for group in groups if isinstance(group, str) and group in settings.roles}
    if not held:
        line = f"{name} is in no group that has a role here"
        raise ProblemError(403, "no-role", line, "ask the administrator of the service: oidc.roles")
    return Person(str(claims["iss"]), str(claims["sub"]), name, max(held, key=ROLES.index))


def _not_proven(line: str) -> ProblemError:
    return ProblemError(403, "sign-in-not-proven", line, "sign in again; if it still fails, see the log")


def _away(error: Exception) -> ProblemError:
    line = f"the provider cannot be used: {error or type(error).__name__}"
    return ProblemError(503, "provider-away", line, "try again, or use a token")

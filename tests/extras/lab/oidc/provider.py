"""`python -m tests.extras.lab.oidc.provider PORT`: a provider of OpenID Connect, the package oidc-provider-mock, in a
process of its own. That one does not look at PKCE; here Authlib's server side does, as it would in a real provider."""

import os
import subprocess
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import httpx

START_WITHIN = 60.0
ENDING_WITHIN = 10.0


@dataclass
class Provider:
    """A running provider. `url` is its issuer."""

    process: subprocess.Popen[bytes]
    url: str

    @property
    def port(self) -> int:
        return int(self.url.rpartition(":")[2])

    def person(self, subject: str, **claims: object) -> None:
        """Makes somebody known. Claims replace those of its ID tokens, `iss` and `nonce`, too."""
        httpx.put(f"{self.url}/users/{subject}", json=claims, timeout=START_WITHIN).raise_for_status()

    def sign_in(self, address: str, subject: str) -> str:
        """Signs somebody in, as its form does. Where it sends them then."""
        answer = httpx.post(address, data={"sub": subject}, timeout=START_WITHIN)
        assert answer.status_code == 302, answer.text
        return answer.headers["location"]

    def end(self) -> None:
        self.process.terminate()
        self.process.wait(ENDING_WITHIN)


@contextmanager
def running_provider(port: int = 0) -> Iterator[Provider]:
    """A provider with a new key."""
    environment = os.environ | {"AUTHLIB_INSECURE_TRANSPORT": "1"}
    command = [sys.executable, "-W", "ignore", "-m", "tests.extras.lab.oidc.provider", str(port)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=environment)
    try:
        assert process.stdout is not None
        url = process.stdout.readline().decode().strip()
        assert url, "the provider did not start"
        yield Provider(process, url)
    finally:
        process.terminate()
        process.wait(ENDING_WITHIN)
        if process.stdout is not None:
            process.stdout.close()


def main() -> None:
    """Serves until it is ended."""
    warnings.simplefilter("ignore")
    import flask
    from authlib.oauth2.rfc7636 import CodeChallenge
    from oidc_provider_mock import _app
    from werkzeug.serving import make_server

    challenges: dict[str, tuple[str, str]] = {}
    plain_save = _app.AuthorizationCodeGrant.save_authorization_code

    def save(self: object, code: str, request: object) -> None:
        plain_save(self, code, request)  # type: ignore[arg-type]
        asked = flask.request.args
        challenges[code] = (asked.get("code_challenge", ""), asked.get("code_challenge_method", "plain"))

    class Checked(CodeChallenge):
        def get_authorization_code_challenge(self, authorization_code: object) -> str:
            return challenges[authorization_code.code][0]  # type: ignore[attr-defined]

        def get_authorization_code_challenge_method(self, authorization_code: object) -> str:
            return challenges[authorization_code.code][1]  # type: ignore[attr-defined]

    checked, plain_call = Checked(required=True), _app.OpenIDCode.__call__

    def extended(self: object, grant: object) -> None:
        plain_call(self, grant)  # type: ignore[arg-type]
        checked(grant)

    _app.AuthorizationCodeGrant.save_authorization_code = save  # type: ignore[method-assign, assignment]
    _app.AuthorizationCodeGrant.TOKEN_ENDPOINT_AUTH_METHODS = ["client_secret_basic", "none"]
    _app.OpenIDCode.__call__ = extended  # type: ignore[method-assign, assignment]
    server = make_server("127.0.0.1", int(sys.argv[1]), _app.app(require_nonce=True), threaded=True)
    print(f"http://127.0.0.1:{server.server_port}", flush=True)
    server.serve_forever()


if __name__ == "__main__":
    main()

"""Routes for sign-in and sign-out by OpenID Connect."""

from __future__ import annotations

import logging
from datetime import timedelta
from typing import TYPE_CHECKING, Annotated

from fastapi import Query, Request, Response
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import RedirectResponse

from daq.contracts.extras import require_extra
from daq.contracts.service.audit import AuditNote
from daq.contracts.service.system import LoginWays, OpenIdWay, SignedOut
from extras.lab.oidc.people import name_of
from extras.lab.oidc.settings import OidcSettings, require_address
from extras.lab.oidc.sign_in import GOOD_FOR, SignIns
from server.access.caller import Caller
from server.access.cookies import is_over_tls, session_cookie, sign_in_cookie
from server.api.dependencies import ServicesDep, Viewer
from server.parts import Part
from server.problems import PROBLEMS, ProblemError, not_found
from server.routes import Router
from server.services import Services

if TYPE_CHECKING:
    from extras.lab.oidc.provider import Provider


class SigningIn(Part):
    """The provider, and sign-ins in progress; `provider` is None if the configuration names none."""

    def __init__(self, services: Services) -> None:
        """Raises SpecError, and MissingExtraError without Authlib."""
        self.settings = services.settings.section(OidcSettings)
        self.sign_ins = SignIns(services.clock)
        self.provider = None
        self.lets_people_in = self.settings.issuer is not None
        if self.lets_people_in:
            require_extra("oidc", "oidc", "authlib")
            from extras.lab.oidc.provider import open_provider

            address = require_address(self.settings, services.settings.server)
            self.provider = open_provider(self.settings, address)


START = "/api/v1/login/start"
HOME = "../../../"
"""The page, relative to the routes below: a proxy may serve the service below a path of its own."""
router = Router(tags=["system"], responses=PROBLEMS)
log = logging.getLogger("server.access")


@router.get("/login")
async def get_login_ways(services: ServicesDep) -> LoginWays:
    """Returns the ways to sign in: always by token, and by OpenID Connect if it is configured. Needs no token."""
    signing_in = services.part(SigningIn)
    if signing_in.provider is None:
        return LoginWays()
    return LoginWays(openid=OpenIdWay(label=signing_in.settings.label, start=START))


@router.get("/login/start", include_in_schema=False)
async def start_login(
    services: ServicesDep,
    request: Request,
    robot: Annotated[str, Query(pattern=r"^([a-z0-9][a-z0-9_-]{0,31})?$", description="What to show afterwards.")] = "",
) -> Response:
    """Sends the browser to the provider of OpenID Connect."""
    signing_in, provider = _signing_in(services)
    asked, cookie = signing_in.sign_ins.begin(robot)
    try:
        address = await provider.ask(asked, services.clock.monotonic())
    except ProblemError as problem:
        return _told(request, services, problem)
    answer = RedirectResponse(address, 303)
    # It must be sent with a link from the provider's page, so it is `lax`; the session's cookie is `strict`.
    _set_cookie(answer, services, sign_in_cookie(_address(services)), cookie, GOOD_FOR, "lax")
    return answer


@router.get("/login/callback", include_in_schema=False)
async def finish_login(services: ServicesDep, request: Request) -> Response:
    """Processes the provider's answer, begins a session, and sends the browser to the page.

    A rejected answer leads to the page's sign-in, with the problem's kind in the URL.
    """
    signing_in, provider = _signing_in(services)
    given = dict(request.query_params)
    cookie = request.cookies.get(sign_in_cookie(_address(services)), "")
    lasts = timedelta(hours=signing_in.settings.hours)
    try:
        with signing_in.sign_ins.answer(given.get("state", ""), cookie) as way:
            person = await provider.answered(way.asked, given, services.clock.monotonic())
            now = services.clock.utc()
            secret, caller = await run_in_threadpool(
                services.sessions.begin, lambda session: name_of(session, person, now), person.role, now, lasts
            )
    except ProblemError as problem:
        return _told(request, services, problem)
    log.info("%s (%s) has signed in", caller.name, caller.role)
    await run_in_threadpool(services.signed_in, caller)  # it waits for a read of the database, which a stop must not
    note = _of_sign_in(request, caller, services)
    services.notify_parts(lambda part: part.acted(note))
    answer = RedirectResponse(f"{HOME}?robot={way.robot}" if way.robot else HOME, 303)
    _forget_cookie(answer, services, sign_in_cookie(_address(services)))
    _set_cookie(answer, services, session_cookie(_address(services)), secret, int(lasts.total_seconds()), "strict")
    return answer


@router.post("/logout")
async def log_out(services: ServicesDep, caller: Viewer, response: Response) -> SignedOut:
    """Ends the caller's session; a token stays valid. Returns the URL that ends the provider's own session."""
    address = None
    if caller.expires is not None and caller.token is not None:
        await run_in_threadpool(services.sessions.end, caller.token)
        await run_in_threadpool(services.signed_out, caller)
        log.info("%s has signed out", caller.name)
        if (provider := services.part(SigningIn).provider) is not None:
            address = await provider.sign_out_address(services.clock.monotonic())
    _forget_cookie(response, services, session_cookie(_address(services)))
    return SignedOut(provider=address)


def _of_sign_in(request: Request, caller: Caller, services: Services) -> AuditNote:
    """Returns the audit log's note of a sign-in. The gate does not make it, since browsers come back by GET."""
    return AuditNote(
        at=services.clock.utc(),
        actor=caller.name,
        role=caller.role,
        origin=request.client.host if request.client else "unknown",
        action="finish_login",
        request="GET /api/v1/login/callback",
        outcome="done",
        status=303,
    )


def _signing_in(services: Services) -> tuple[SigningIn, Provider]:
    """Returns the part and its provider. Raises a 404 without a provider."""
    found = services.part(SigningIn)
    if found.provider is None:
        raise not_found("sign-in by OpenID Connect", "the section [oidc] of the configuration names a provider")
    return found, found.provider


def _address(services: Services) -> str | None:
    return services.settings.server.address


def _set_cookie(answer: Response, services: Services, name: str, value: str, seconds: int, same_site: str) -> None:
    """Both cookies are for the whole service, as the prefix of their names (`__Host-`) requires."""
    answer.set_cookie(
        name,
        value,
        max_age=seconds,
        path="/",
        secure=is_over_tls(_address(services)),
        httponly=True,
        samesite=same_site,  # type: ignore[arg-type]
    )


def _forget_cookie(answer: Response, services: Services, name: str) -> None:
    answer.delete_cookie(name, path="/", secure=is_over_tls(_address(services)), httponly=True)


def _told(request: Request, services: Services, problem: ProblemError) -> Response:
    """Sends the browser to the page's sign-in, which describes each kind of problem. The logs have the details.

    Anybody can cause such problems without limit.
    """
    log.warning("sign-in: %s: %s", problem.kind, problem.detail)
    services.notify_parts(lambda part: part.refused(problem.kind))
    note = AuditNote(
        at=services.clock.utc(),
        actor=None,
        origin=request.client.host if request.client else "unknown",
        action=request.scope["route"].name,
        request=f"GET {request.scope['path']}",
        outcome="refused",
        status=303,
        detail=problem.kind,
    )
    services.notify_parts(lambda part: part.acted(note, again=True))
    return RedirectResponse(f"{HOME}?sign-in={problem.kind}", 303)

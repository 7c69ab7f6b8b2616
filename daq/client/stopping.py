"""Requests a stop at two addresses at once: the service's, and that of the stop listener, which does not depend on the
service's event loop."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from urllib.parse import quote

import httpx
from pydantic import ValidationError

from daq.client.connection import API
from daq.client.errors import reason_of
from daq.contracts.service.problems import ProblemDetails
from daq.contracts.service.robot import StopResult
from daq.contracts.service.system import stop_port_after

CONNECT_WITHIN = 1.0
ANSWER_WITHIN = 3.0
"""Time-out (s) for one address; the service itself answers within 1.1 s, even without a link."""


class RefusedStop(StopResult):
    """The service answered why it does not stop."""


class NoSuchRobot(RefusedStop):
    """The service answered that it has no robot of this name."""


def stop_addresses(url: str, stop_url: str | None = None) -> list[str]:
    """Returns the addresses for a stop: the service, and its stop listener. The latter is `stop_url`, otherwise the
    port after the service's, if its address contains one."""
    if stop_url is not None:
        return [url, stop_url.rstrip("/")]
    found = httpx.URL(url)
    if found.scheme != "http" or found.port is None:
        return [url]  # behind a proxy the listener's address is unknown
    return [url, str(found.copy_with(port=stop_port_after(found.port), path="/")).rstrip("/")]


def stop(addresses: Sequence[str], path: str, token: str | None, kind: type[StopResult] = StopResult) -> StopResult:
    """Requests a stop at every address at once. The first confirmed answer counts, otherwise the most informative one.

    Never raises: errors are in the result, which then advises to use the emergency stop.
    """
    headers = {} if token is None else {"Authorization": f"Bearer {token}"}
    pool = ThreadPoolExecutor(len(addresses), thread_name_prefix="stop")
    asked: set[Future[StopResult]] = {
        pool.submit(_ask, f"{address}{API}/{quote(path)}/stop", headers, kind) for address in addresses
    }
    answers: list[StopResult] = []
    try:
        while asked:
            done, asked = wait(asked, return_when=FIRST_COMPLETED)
            answers += [one.result() for one in done]
            if any(answer.confirmed for answer in answers):
                break
    finally:
        pool.shutdown(wait=False)
    return max(answers, key=_tells)


def _tells(answer: StopResult) -> tuple[bool, bool, bool, bool, bool]:
    """Rank of an answer: the more it confirms or explains, the higher."""
    refused, is_unknown = isinstance(answer, RefusedStop), isinstance(answer, NoSuchRobot)
    return answer.confirmed, answer.delivered, answer.seconds > 0, is_unknown, refused


def _ask(url: str, headers: dict[str, str], kind: type[StopResult]) -> StopResult:
    try:
        timeout = httpx.Timeout(ANSWER_WITHIN, connect=CONNECT_WITHIN)
        response = httpx.post(url, headers=headers, timeout=timeout, trust_env=False)
    except httpx.HTTPError as error:
        return _undelivered(f"{url}: {reason_of(error)}")
    try:
        if response.is_success:
            return kind.model_validate_json(response.content, extra="ignore")
        problem = ProblemDetails.model_validate_json(response.content)
        why = f"{problem.detail}; {problem.advice}".strip("; ")
        return _undelivered(why, NoSuchRobot if problem.status == 404 else RefusedStop)
    except ValidationError:
        return _undelivered(f"{url}: answers {response.status_code}, but is no such service")


def _undelivered(why: str, kind: type[StopResult] = StopResult) -> StopResult:
    text = f"stop NOT DELIVERED: {why}. Use the emergency stop."
    return kind(delivered=False, confirmed=False, seconds=0.0, note=why, text=text)

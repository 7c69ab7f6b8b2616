"""Requests that are sent again: the key that says so, in both places that know one."""

import pytest

from tests.server.service import Service


@pytest.mark.parametrize("key", ["", "k" * 201])
@pytest.mark.parametrize("path", ["/experiments", "/jobs"])
def test_a_key_that_says_nothing_is_refused(service: Service, path: str, key: str) -> None:
    body = {"kind": "compare", "traces": ["a"]} if path == "/jobs" else {}
    refused = service.robot.post(path, json=body, headers={"Idempotency-Key": key})
    assert refused.status_code == 422, refused.text
    assert refused.json()["fields"][0]["field"] == "idempotency-key"

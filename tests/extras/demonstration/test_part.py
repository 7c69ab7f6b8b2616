"""A demonstration that fails opens its secret: a visitor may have guessed it."""

from datetime import UTC, datetime
from types import SimpleNamespace
from typing import Any

from daq.contracts.machine import load_machine
from daq.contracts.service.hidden import Hidden, HideRequest
from extras.demonstration.hidden import Sealed, draw
from extras.demonstration.part import Demonstrations


def test_a_search_that_failed_opens_its_secret_without_an_answer() -> None:
    services: Any = SimpleNamespace(jobs=None, clock=None, traces=None)
    rig: Any = SimpleNamespace(robot=SimpleNamespace(name="arm", machine=load_machine("ma2000")))
    request = HideRequest(effect="coulomb_friction", joint=2)
    sealed = draw(request)
    demonstrations = Demonstrations(services)

    def failed(drawn: Sealed) -> Hidden:
        demonstrations._latest["arm"] = Hidden(
            id="a", state="diagnosing", began=datetime(2026, 3, 2, tzinfo=UTC), seal=sealed.seal, picked=request
        )
        demonstrations._failed(rig, drawn, "why")
        return demonstrations._latest["arm"]

    found = failed(sealed)
    assert (found.state, found.problem) == ("failed", "why")
    assert found.secret is not None
    assert (found.secret.effect, found.secret.joints, found.secret.outcome) == ("coulomb_friction", (2,), "unanswered")
    # Without its seed it stays sealed, and the failure is told all the same
    unknown = failed(Sealed(seed=-1, seal=""))
    assert (unknown.state, unknown.secret) == ("failed", None)

"""The operator's consent is True, and nothing that only counts as true."""

from typing import Any, cast

import pytest

from daq.client import Client
from daq.contracts.errors import SpecError
from daq.runner.preparation import Consent


@pytest.mark.parametrize("word", [0, 1, "true", "yes", None, 1.0])
def test_what_is_like_it_is_refused_before_anything_is_asked(word: object) -> None:
    given = cast(Any, word)
    with pytest.raises(SpecError, match="moves_real_arm = "):
        Consent(given)
    with Client("http://127.0.0.1:1") as client:
        robot = client.robot("ma2000")
        for say in (lambda: robot.control(moves_real_arm=given), lambda: robot.queue.resume(moves_real_arm=given)):
            with pytest.raises(SpecError, match="True is the operator's consent"):
                say()


def test_only_given_consent_moves_a_real_arm() -> None:
    assert (Consent(True).moves_real_arm, Consent().moves_real_arm) == (True, False)

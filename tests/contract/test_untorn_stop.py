"""A stop freezes the posture where the arm is, also in the moment at which a position is being stored."""

import pytest

from daq.driver import Controller
from firmware_protocol.commands import Capability
from tests.contract.untorn_stop import NEAR, frozen_far_away


@pytest.mark.motion
def test_a_stop_never_freezes_a_torn_position(controller: Controller) -> None:
    if Capability.LOCK_STEP in controller.identity.capabilities:  # elsewhere the moment is met by chance alone
        assert frozen_far_away(controller) <= NEAR

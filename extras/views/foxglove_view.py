"""Live samples for Foxglove: a WebSocket server of its protocol with `JointStates`, and JSON for each joint.

Traces need no server: Foxglove opens their MCAP files.
"""

from __future__ import annotations

from collections.abc import Sequence

import foxglove
from foxglove.channels import JointStatesChannel
from foxglove.messages import JointState, JointStates, Timestamp

from daq.contracts.service.live import SampleMessage

SIGNALS = ("set_point", "position", "error", "drive")
SCHEMA = {"type": "object", "properties": {name: {"type": "number"} for name in ("tick", *SIGNALS)}}


class FoxgloveView:
    """A server at `port` of this computer (0: any free port). names: joints, by their numbers. Raises OSError."""

    def __init__(self, title: str, names: Sequence[str], port: int = 8765) -> None:
        self._names = tuple(names)
        self._context = foxglove.Context()  # a channel belongs to a context: several servers do not mix
        self._states = JointStatesChannel("/joint_states", context=self._context)
        self._joints = [
            foxglove.Channel(f"/joints/{name}", schema=SCHEMA, message_encoding="json", context=self._context)
            for name in names
        ]
        self._server = foxglove.start_server(name=title, host="127.0.0.1", port=port, context=self._context)

    @property
    def url(self) -> str:
        """Address of the server."""
        return f"ws://127.0.0.1:{self._server.port}"

    def sample(self, sample: SampleMessage, utc: float) -> None:
        """Publishes a live sample, taken at `utc` (s since 1970)."""
        at_ns = round(utc * 1e9)
        pairs = list(zip(sample.joints, sample.position, strict=True))
        states = [JointState(name=self._names[joint - 1], position=place) for joint, place in pairs]
        stamp = Timestamp(sec=at_ns // 10**9, nsec=at_ns % 10**9)
        self._states.log(JointStates(timestamp=stamp, joints=states), log_time=at_ns)
        for column, joint in enumerate(sample.joints):
            values = {signal: getattr(sample, signal)[column] for signal in SIGNALS}
            self._joints[joint - 1].log({"tick": sample.tick, **values}, log_time=at_ns)

    def close(self) -> None:
        """Ends the server."""
        self._server.stop()

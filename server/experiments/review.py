"""Review of an experiment before it moves a real arm: the approved content, the reviewer, and whether the approval is
sufficient. Pure.

An approval is valid for exactly one content: the specification, the start time, the robot, and its machine file with
the configured limits, since with other limits the same specification may become another motion.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Collection
from dataclasses import dataclass
from datetime import UTC, datetime

from daq.contracts.experiment import ExperimentSpec
from daq.contracts.machine import Machine
from daq.contracts.service.queue import Reviewer
from daq.contracts.service.robot import RobotIdentity


@dataclass(frozen=True)
class Given:
    """An approval: its content, the reviewer's name, and whether the reviewer was an owner of the robot."""

    content: str
    by: str
    as_owner: bool


@dataclass(frozen=True)
class Review:
    """The rule of one robot. reviewer: who must approve; None for nobody. machine: digest of its machine."""

    robot: str
    machine: str
    reviewer: Reviewer | None

    @classmethod
    def of(cls, robot: str, machine: Machine, reviewer: Reviewer | None) -> Review:
        """Returns the rule of a robot with this machine."""
        return cls(robot, _digest(machine.model_dump(mode="json")), reviewer)

    def content(self, given: str) -> str:
        """Returns the content to which an approval is bound, for a specification's digest `given` (`digest_of`)."""
        return _digest([self.robot, self.machine, given])

    def is_enough(self, given: Given | None, content: str, authors: Collection[str]) -> bool:
        """Whether an approval permits this content (from `content`). `authors`: people who own, submitted or changed
        the experiment; none of them can have approved it."""
        if self.reviewer is None:
            return True
        if given is None or given.content != content or given.by in authors:
            return False
        return given.as_owner or self.reviewer == "operator"

    def is_needed(self, identity: RobotIdentity | None, url: str) -> bool:
        """Whether a review is needed for the connected arm or, while none is connected, for an arm at this port."""
        if self.reviewer is None:
            return False
        return not url.startswith("mock://") if identity is None else not identity.simulated


def digest_of(spec: ExperimentSpec, at: datetime | None) -> str:
    """Returns the digest (SHA-256) of an experiment: its specification, and its start time if it has one."""
    return _digest([spec.model_dump(mode="json"), None if at is None else at.astimezone(UTC).isoformat()])


def _digest(content: object) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True, separators=(",", ":")).encode()).hexdigest()

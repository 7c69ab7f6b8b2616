"""Safety checks on the host. They are pure: they return verdicts, on which the caller acts. They do not replace the
hardware's emergency stop."""

from daq.safety.check_plan import check_move_to_start, check_plan, unchecked
from daq.safety.findings import Finding, Verdict
from daq.safety.guards import RestGuards, RunningGuards
from daq.safety.joint_limits import largest_step
from daq.safety.states import Action, Arm, Event, IllegalEventError, State, advance
from daq.safety.violation import Violation

__all__ = [
    "Action",
    "Arm",
    "Event",
    "Finding",
    "IllegalEventError",
    "RestGuards",
    "RunningGuards",
    "State",
    "Verdict",
    "Violation",
    "advance",
    "check_move_to_start",
    "check_plan",
    "largest_step",
    "unchecked",
]

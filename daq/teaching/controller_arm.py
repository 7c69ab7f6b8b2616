"""Adapts the motor controller to the interface for teaching: all joints, one control period at a time, in SI units."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager

from daq.contracts.experiment import Gain
from daq.contracts.machine import Machine
from daq.contracts.sample import SampleRow
from daq.driver import Controller, ControllerRestartedError, HardwareFaultError, NoSampleError
from daq.link import LinkError, RequestRefusedError
from daq.runner.arm_control import ArmControl, StoppedError
from daq.runner.preparation import require_matching_machine, require_period
from daq.runner.rows import RowMaker
from daq.safety import Event
from daq.teaching import halting
from daq.teaching.arm import TeachingError


class ControllerArm:
    """A `TeachableArm` over the driver, with the states of `ArmControl` as in every run.

    ended:        returns the reason of an external request to end; None if there is none
    every_period: True delivers each period once, in order; False the newest, which a slow line supports

    Raises SafetyError if the machine file does not match the controller, or its period differs.
    """

    def __init__(
        self,
        controller: Controller,
        control: ArmControl,
        machine: Machine,
        ended: Callable[[], str | None],
        *,
        every_period: bool = True,
    ) -> None:
        require_matching_machine(controller, machine)
        require_period(controller, machine)
        self.joints = tuple(range(1, len(machine.joints) + 1))
        self.lateness = 0.0
        self._controller = controller
        self._control = control
        self._ended = ended
        self._every_period = every_period
        self._rows = RowMaker(machine, self.joints, controller.period_s)
        self._last: int | None = None
        self.every = controller.line_rate(self.joints, self.joints, together=False).every
        """Control periods from one sample to the next, as the line allows."""

    @contextmanager
    def driven(self) -> Iterator[None]:
        """The arm is armed and running within the block, and idle afterwards."""
        with self._control.frozen_on_error():
            self._step(Event.ARM)
            self._step(Event.START)
            yield
            self._require_going_on()
            self._step(Event.FINISHED)
            self._step(Event.DISARM)

    def next_sample(self) -> SampleRow:
        """Returns the next sample; skips none, unless only the newest are wanted."""
        self._require_going_on()
        try:
            known = self._every_period and self._last is not None
            after = (self._last or 0) + self.every - 1 if known else None
            snapshot = self._controller.next_snapshot(after, self.joints)
        except (LinkError, NoSampleError) as error:
            raise halting.freeze_for_fault(self._control, str(error), Event.LINK_LOST) from error
        except (ControllerRestartedError, HardwareFaultError) as error:
            raise self.freeze_for_fault(str(error)) from error
        self._last, self.lateness = snapshot.tick, snapshot.jitter
        return self._rows.row(snapshot)

    def set_points(self, postures: Mapping[int, int]) -> None:
        """Sends joint → posture units 0–999, applied together; only while driven."""
        self._require_going_on()
        if not self._control.may_send:
            raise TeachingError(f"set points are sent only while the arm is driven: it is {self._control.arm.state}")
        try:
            self._controller.set_points(postures)
        except RequestRefusedError as error:
            raise self.freeze_for_stop(self._ended() or str(error)) from error

    def gains(self) -> Mapping[int, Gain]:
        """Joint → (P, I, D)."""
        return self._controller.gains()

    def set_gains(self, joint: int, p: int, i: int, d: int) -> None:
        """Writes the gains of a joint and reads them back."""
        self._require_going_on()
        self._controller.set_gains(joint, p, i, d)

    def freeze_for_stop(self, cause: str) -> StoppedError:
        """Freezes the arm on request."""
        return halting.freeze_for_stop(self._control, cause)

    def freeze_for_fault(self, cause: str) -> TeachingError:
        """Freezes the arm because of a fault."""
        return halting.freeze_for_fault(self._control, cause)

    def _require_going_on(self) -> None:
        cause = self._ended() or self._control.halted
        if cause is not None:
            raise self.freeze_for_stop(cause)

    def _step(self, event: Event) -> None:
        try:
            self._control.handle(event)
        except StoppedError as error:  # a stop came meanwhile; the error contains its result
            raise self.freeze_for_stop(self._ended() or self._control.halted or error.cause) from error

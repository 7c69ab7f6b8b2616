"""Every transition of the arm's states, and every event that is refused."""

import itertools

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from daq.safety import Action, Arm, Event, IllegalEventError, State, advance

HALT = (Action.CEASE, Action.FREEZE)
UP = {state: Arm(state, connected=state is not State.DISCONNECTED) for state in State}

TRANSITIONS = {
    (State.DISCONNECTED, Event.CONNECTED): (State.IDLE, ()),
    (State.DISCONNECTED, Event.LINK_LOST): (State.DISCONNECTED, ()),
    (State.DISCONNECTED, Event.STOP): (State.DISCONNECTED, HALT),
    (State.DISCONNECTED, Event.TRIP): (State.FAULT, HALT),
    (State.IDLE, Event.LINK_LOST): (State.DISCONNECTED, ()),
    (State.IDLE, Event.ARM): (State.ARMED, ()),
    (State.IDLE, Event.STOP): (State.STOPPED, HALT),
    (State.IDLE, Event.TRIP): (State.FAULT, HALT),
    (State.ARMED, Event.LINK_LOST): (State.FAULT, HALT),
    (State.ARMED, Event.DISARM): (State.IDLE, ()),
    (State.ARMED, Event.START): (State.RUNNING, (Action.SEND,)),
    (State.ARMED, Event.STOP): (State.STOPPED, HALT),
    (State.ARMED, Event.TRIP): (State.FAULT, HALT),
    (State.RUNNING, Event.LINK_LOST): (State.FAULT, HALT),
    (State.RUNNING, Event.FINISHED): (State.ARMED, (Action.CEASE,)),
    (State.RUNNING, Event.STOP): (State.STOPPED, HALT),
    (State.RUNNING, Event.TRIP): (State.FAULT, HALT),
    (State.STOPPED, Event.LINK_LOST): (State.DISCONNECTED, ()),
    (State.STOPPED, Event.RESET): (State.IDLE, (Action.RELEASE,)),
    (State.STOPPED, Event.STOP): (State.STOPPED, HALT),
    (State.STOPPED, Event.TRIP): (State.FAULT, HALT),
    (State.FAULT, Event.LINK_LOST): (State.FAULT, ()),
    (State.FAULT, Event.RESET): (State.IDLE, (Action.RELEASE,)),
    (State.FAULT, Event.STOP): (State.FAULT, HALT),
    (State.FAULT, Event.TRIP): (State.FAULT, HALT),
}


@pytest.mark.parametrize(("before", "event"), list(itertools.product(State, Event)))
def test_each_event_leads_to_its_state_and_actions(before: State, event: Event) -> None:
    if (before, event) in TRANSITIONS:
        arm, actions = advance(UP[before], event)
        assert (arm.state, actions) == TRANSITIONS[before, event]
    else:
        with pytest.raises(IllegalEventError, match=f"cannot {event} while {before}: "):
            advance(UP[before], event)


@pytest.mark.parametrize("before", [State.ARMED, State.RUNNING])
def test_an_arm_whose_link_was_lost_is_reset_as_one_that_is_not_there(before: State) -> None:
    lost, _ = advance(UP[before], Event.LINK_LOST)
    assert lost == Arm(State.FAULT, connected=False, cause="link lost")
    assert advance(lost, Event.RESET) == (Arm(State.DISCONNECTED, connected=False, cause="link lost"), ())
    back, actions = advance(lost, Event.CONNECTED)
    assert (back, actions) == (Arm(State.FAULT, connected=True, cause="link lost"), (Action.FREEZE,))


def test_faults_and_stops_outlive_a_lost_link_and_a_reset_that_is_not_theirs() -> None:
    # A fault is latched when the link comes back and the arm is frozen again
    lost, _ = advance(UP[State.RUNNING], Event.LINK_LOST)
    back, actions = advance(lost, Event.CONNECTED)
    assert (back.state, back.connected, actions) == (State.FAULT, True, (Action.FREEZE,))
    # A stop outlives a lost link and is sent again when it is back
    stopped, _ = advance(UP[State.RUNNING], Event.STOP, "somebody")
    lost, _ = advance(stopped, Event.LINK_LOST)
    back, actions = advance(lost, Event.CONNECTED)
    assert (back.state, back.cause, actions) == (State.STOPPED, "somebody", (Action.FREEZE,))
    # Arming releases nobodys stop
    with pytest.raises(IllegalEventError, match="cannot arm while stopped"):
        advance(UP[State.STOPPED], Event.ARM)
    # A reset without a link cannot end the boards freeze so the arm comes back stopped
    lost, _ = advance(UP[State.RUNNING], Event.LINK_LOST, "cable")
    arm, actions = advance(lost, Event.RESET)
    assert (arm, actions) == (Arm(State.DISCONNECTED, connected=False, cause="cable"), ())
    arm, actions = advance(arm, Event.CONNECTED)
    assert (arm.state, actions) == (State.STOPPED, (Action.FREEZE,))
    # A refusal says what to do
    with pytest.raises(IllegalEventError, match=r"^cannot start while idle: arm first$"):
        advance(UP[State.IDLE], Event.START)
    with pytest.raises(IllegalEventError, match=r"cannot arm while fault: .*reset a stop or a fault first"):
        advance(UP[State.FAULT], Event.ARM)


def test_the_first_cause_of_a_fault_is_kept_and_replaces_that_of_a_stop() -> None:
    arm, _ = advance(UP[State.RUNNING], Event.TRIP, "joint 2 stuck")
    arm, _ = advance(arm, Event.TRIP, "stale sample")
    arm, _ = advance(arm, Event.STOP, "operator")
    assert arm.cause == "joint 2 stuck"
    arm, _ = advance(arm, Event.RESET)
    assert arm.cause is None
    arm, _ = advance(UP[State.RUNNING], Event.STOP, "operator")
    assert arm.cause == "operator"
    assert advance(arm, Event.TRIP, "unexpected motion")[0].cause == "unexpected motion"
    assert advance(UP[State.IDLE], Event.STOP)[0].cause == "on request"
    assert advance(UP[State.IDLE], Event.TRIP)[0].cause == "guard tripped"


class ArmUnderAnyEvents(RuleBasedStateMachine):
    """Whatever comes, in whatever order."""

    def __init__(self) -> None:
        super().__init__()
        self.arm = Arm()
        self.sending = False
        self.frozen = False
        self.reset_since_fault = True

    @rule(event=st.sampled_from(Event))
    def happens(self, event: Event) -> None:
        before = self.arm
        try:
            self.arm, actions = advance(self.arm, event, "because")
        except IllegalEventError:
            assert self.arm == before
            assert event not in (Event.STOP, Event.TRIP, Event.LINK_LOST)
            return
        for action in actions:
            self.sending = action is Action.SEND or (self.sending and action is not Action.CEASE)
            self.frozen = action is Action.FREEZE or (self.frozen and action is not Action.RELEASE)
        if event in (Event.STOP, Event.TRIP):
            assert self.frozen
        if before.state is State.FAULT and self.arm.state is not State.FAULT:
            assert event is Event.RESET

    @invariant()
    def set_points_are_sent_only_while_running(self) -> None:
        assert self.sending == (self.arm.state is State.RUNNING)

    @invariant()
    def nothing_is_armed_while_frozen_or_without_a_link(self) -> None:
        if self.arm.state in (State.ARMED, State.RUNNING):
            assert self.arm.connected
            assert not self.frozen

    @invariant()
    def disconnected_means_no_link_and_idle_means_one(self) -> None:
        if self.arm.state is State.DISCONNECTED:
            assert not self.arm.connected
        if self.arm.state is State.IDLE:
            assert self.arm.connected


TestArmUnderAnyEvents = ArmUnderAnyEvents.TestCase
TestArmUnderAnyEvents.settings = settings(max_examples=100, stateful_step_count=40)

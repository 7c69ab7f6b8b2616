"""What a trace says about itself is believed within bounds only, since another program may have written it."""

import json

import pytest

from daq.contracts.errors import TraceError
from daq.contracts.trace_limits import TraceLimits
from daq.traces.metadata import extent_of, joints_of, record_of, signals_of
from tests.daq.traces.samples import record

LIMITS = TraceLimits(joints=6)
END = {"outcome": "stopped", "counters": '{"retries": 2}', "samples": "7", "duration": "0.12"}


def start(**changes: object) -> dict[str, str]:
    """Metadata at the start, with fields of the record changed."""
    return {"record": json.dumps(json.loads(record().model_dump_json()) | changes)}


def test_outcome_and_counters_come_from_the_end() -> None:
    assert record_of(start(), None, "a") == record()
    ended = record_of(start(), END, "a")
    assert (ended.outcome, ended.counters) == ("stopped", {"retries": 2})
    assert record_of(start(), END | {"outcome": ""}, "a").outcome is None


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"trace_id": "../etc"}, "its ID '../etc' must be letters, digits, - and _"),
        ({"trace_id": "a" * 65}, "is not letters"),
        ({"trace_id": ""}, "is not letters"),
        ({"created": "2026-01-01T00:00:00"}, "created = 2026-01-01T00:00:00 has no time zone"),
        ({"source": "dream"}, "its metadata is not that of a trace: source: "),
    ],
)
def test_a_record_that_is_none_is_refused_in_one_line(changes: dict[str, object], says: str) -> None:
    with pytest.raises(TraceError) as caught:
        record_of(start(**changes), None, "a")
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


def test_metadata_that_lack_something_say_what() -> None:
    with pytest.raises(TraceError, match="'record' is missing"):
        record_of({}, None, "a")
    with pytest.raises(TraceError, match="'counters' is missing"):
        record_of(start(), {"outcome": ""}, "a")
    with pytest.raises(TraceError, match="'signals' is missing"):
        signals_of({}, "a")


@pytest.mark.parametrize(
    ("text", "joints"),
    [
        ("1", (1,)),
        ("3 1 99", (3, 1, 99)),
        ("1 2 3 4 5 6", (1, 2, 3, 4, 5, 6)),
        ("10  11  12  13  14", (10, 11, 12, 13, 14)),
    ],
)
def test_joints_keep_their_order(text: str, joints: tuple[int, ...]) -> None:
    assert joints_of({"joints": text}, LIMITS, "a") == joints


@pytest.mark.parametrize(
    "text", ["", "0", "1 1", "100", "01", "1 x", "1 2 3 4 5 6 7", "1 " * 40, "10  11  12  13   14"]
)
def test_what_is_no_list_of_joints_is_refused(text: str) -> None:
    with pytest.raises(TraceError, match=r"are not 1 to 6 different numbers of joints \(traces.limits.joints\)"):
        joints_of({"joints": text}, LIMITS, "a")


def test_signals_are_named_by_words() -> None:
    assert signals_of({"signals": "position drive"}, "a") == {"position", "drive"}


@pytest.mark.parametrize(("samples", "duration"), [("0", "0.0"), ("7", "0.12"), (str(2**31 - 1), "1e9")])
def test_an_extent_is_a_number_of_samples_and_a_time(samples: str, duration: str) -> None:
    assert extent_of({"samples": samples, "duration": duration}, "a") == (int(samples), float(duration))


@pytest.mark.parametrize(
    ("samples", "duration"), [("-1", "0"), (str(2**31), "0"), ("1", "-0.1"), ("1", "inf"), ("1", "nan"), ("x", "0")]
)
def test_an_impossible_extent_is_refused(samples: str, duration: str) -> None:
    with pytest.raises(TraceError, match="its metadata is not that of a trace: "):
        extent_of({"samples": samples, "duration": duration}, "a")

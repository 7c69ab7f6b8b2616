"""The port's URL names the line protocol: one of those that ship, or one of another installed package."""

import sys
from pathlib import Path

import pytest

from daq.link import dialects
from daq.link.dialects import dialect_of
from daq.plugins import Plugin
from daq.transport import MockPort, SerialPort, parse_port_url
from daq.transport.url import PortUrlError
from firmware_protocol.dialect import FramedDialect
from firmware_protocol.dynamixel.dialect import DynamixelDialect
from firmware_protocol.scale import LineScale

MINE = """
from firmware_protocol.dialect import FramedDialect
from firmware_protocol.scale import LineScale

class Mine(FramedDialect):
    def __init__(self, ids):
        super().__init__()
        self.scale = LineScale(joints=len(ids))
"""


def test_without_a_name_it_is_the_dialect_of_the_bridge() -> None:
    assert isinstance(dialect_of("serial:///dev/ttyUSB0"), FramedDialect)
    assert dialect_of("mock://").scale == LineScale()


def test_servos_are_named_with_their_ids() -> None:
    url = "serial:///dev/ttyUSB0?baud=1000000&dialect=dynamixel&ids=5,3"
    assert parse_port_url(url) == SerialPort("/dev/ttyUSB0", 1000000, "dynamixel", (5, 3))
    dialect = dialect_of(url)
    assert isinstance(dialect, DynamixelDialect)
    assert (dialect.scale.joints, dialect.scale.set_point_units) == (2, 4096)


def test_a_mock_of_servos_is_given_its_options() -> None:
    port = parse_port_url("mock://?dialect=dynamixel&ids=1,2&load=0.2&baud=57600")
    assert port == MockPort(("--ids=1,2", "--load=0.2", "--torque"), 57600, dialect="dynamixel", ids=(1, 2))


def installed(folder: Path, monkeypatch: pytest.MonkeyPatch, text: str) -> None:
    (folder / "mine_of_a_lab.py").write_text(text)
    monkeypatch.syspath_prepend(str(folder))
    monkeypatch.delitem(sys.modules, "mine_of_a_lab", raising=False)
    monkeypatch.setattr(dialects, "plugins", lambda: (Plugin(dialects={"mine": "mine_of_a_lab:Mine"}),))


def test_another_package_brings_its_own_dialect(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    installed(tmp_path, monkeypatch, MINE)
    assert dialect_of("tcp://arm:4000?dialect=mine&ids=7,8,9").scale.joints == 3


REFUSING = "\n        from firmware_protocol.errors import ProtocolError\n        raise ProtocolError('ids: two')\n"


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("import nothing_of_this_name", "dialect 'mine' (mine_of_a_lab:Mine): ModuleNotFoundError: No module named"),
        ("class Yours: pass", "dialect 'mine' (mine_of_a_lab:Mine): AttributeError: "),
        (MINE + REFUSING, "port 'tcp://arm:4000?dialect=mine': ids: two"),
    ],
    ids=["needs what is not there", "has another name", "refuses its numbers"],
)
def test_a_dialect_of_another_package_that_fails_gets_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, line: str
) -> None:
    installed(tmp_path, monkeypatch, text)
    with pytest.raises(PortUrlError) as error:
        dialect_of("tcp://arm:4000?dialect=mine")
    assert line in str(error.value)


@pytest.mark.parametrize(
    ("url", "line"),
    [
        ("tcp://arm:1?dialect=nobodys", "dialect 'nobodys' is unknown: dynamixel, framed"),
        ("tcp://arm:1?dialect=dynamixel", "needs the servos' IDs in the order of the joints, as in ids=1,2"),
        ("tcp://arm:1?dialect=dynamixel&ids=1,x", "ids '1,x': write whole numbers in the order of the joints"),
        ("tcp://arm:1?dialect=dynamixel&ids=1,1", "1 to 6 different ones from 0 to 252"),
        ("tcp://arm:1?dialect=dynamixel&ids=1,253", "1 to 6 different ones from 0 to 252"),
        ("mock://?dialect=dynamixel&ids=1,2&fault=flip", "unknown option 'fault'"),
    ],
)
def test_a_wrong_name_or_number_gets_one_line(url: str, line: str) -> None:
    with pytest.raises(PortUrlError) as error:
        dialect_of(url)
    assert line in str(error.value)

"""A service tells its webhooks what happens; a command tries them; nobody sees or changes an address by a request."""

import json
from pathlib import Path
from typing import Any, NoReturn

import pytest
from standardwebhooks import Webhook as Witness

from extras.lab.notifications.settings import NotificationSettings
from server.clock import SystemClock
from tests.daq_cli.invoke import CommandLine
from tests.extras.lab.notifications.receivers import SECRET, Receiver, receiver, secret_file
from tests.server.inside import service_inside

PATH = "/s3cret-path"


def settings_of(folder: Path, there: Receiver, **options: Any) -> dict[str, Any]:
    """The section of a configuration with one webhook at a receiver."""
    webhook = {"url": f"http://127.0.0.1:{there.port}{PATH}", "secret": str(secret_file(folder)), **options}
    return {"webhooks": {"lab": webhook}}


def test_the_end_of_an_experiment_and_a_pause_reach_the_webhook(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with receiver() as there:
        section = NotificationSettings.model_validate(settings_of(tmp_path, there))
        with service_inside(tmp_path, SystemClock(), monkeypatch, sections={"notifications": section}) as robot:
            assert robot.post("connect").status_code == 200
            spec = {"trajectory": {"kind": "pause", "duration": 0.1}, "joints": [1]}
            made = robot.post("experiments", json={"spec": spec}).json()
            ended = robot.get(f"experiments/{made['id']}?wait=60").json()
            assert there.arrived.wait(60)
            told: Any = Witness(SECRET).verify(there.posted[0].body, there.posted[0].headers)
            assert (told["type"], told["data"]["experiment"], told["data"]["state"]) == (
                "experiment.ended",
                made["id"],
                ended["state"],
            )
            there.arrived.clear()
            robot.post("stop")
            assert there.arrived.wait(60)
            told = json.loads(there.posted[1].body)
            assert (told["type"], told["data"]["kind"]) == ("queue.paused", "attention")
            service = str(robot.base_url).partition("/robots/")[0]
            shown = robot.get(f"{service}/notifications").json()["destinations"][0]
            assert (shown["name"], shown["host"], shown["sent"] >= 1) == ("lab", "127.0.0.1", True)
            for address in (f"{service}/notifications", f"{service}/system", f"{service}/audit"):
                assert PATH not in robot.get(address).text
            metrics = robot.get(service.replace("/api/v1", "/metrics")).text
            assert 'daq_notifications_total{destination="webhook lab",result="sent"}' in metrics
            assert "daq_audit_rows_total" in metrics
            assert robot.put(f"{service}/notifications", json={}).status_code == 405


def test_a_command_tries_every_destination(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    daq = CommandLine(capsys)
    with receiver() as there:
        table = settings_of(tmp_path, there)["webhooks"]["lab"]
        (tmp_path / "daq.toml").write_text(
            f'[notifications.webhooks.lab]\nurl = "{table["url"]}"\n'
            f'secret = "{table["secret"]}"\n[notifications.webhooks.far]\nurl = "http://127.0.0.1:9/x"\n',
            "utf-8",
        )
        page = Path(__file__).parents[4] / "docs" / "notifications.md"
        commands = [line[6:] for line in page.read_text("utf-8").splitlines() if line.startswith("$ daq ")]
        assert commands == ["notify test", "notify test lab"]
        told = daq(*commands[1].split())
        assert (told.code, told.out.startswith("webhook lab: answered 204")) == (0, True)
        assert Witness(SECRET).verify(there.posted[0].body, there.posted[0].headers)
        told = daq(*commands[0].split(), "--json")
        assert told.code == 3
        problems = {one["destination"]: one["problem"] for one in json.loads(told.out)}
        assert problems["webhook lab"] == ""
        assert problems["webhook far"].startswith("127.0.0.1: cannot be connected to")
    daq("notify", "test", "nobody").complains(2, "no destination 'nobody'; available: lab, far")
    assert PATH not in daq("config", "show").out
    (tmp_path / "daq.toml").write_text("")
    daq("notify", "test").complains(2, "no notifications are configured", "[notifications]")


def test_a_fault_while_a_test_is_sent_is_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fails(*_: object) -> NoReturn:
        raise RuntimeError("with the secret in its words")

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("extras.lab.notifications.senders.Mail.send", fails)
    mail = '[notifications.smtp]\nhost = "localhost"\nsender = "arm@lab.example"\n[notifications.email.anna]\n'
    (tmp_path / "daq.toml").write_text(f'{mail}to = "anna@lab.example"\n', "utf-8")
    told = CommandLine(capsys)("notify", "test")
    assert (told.code, told.err) == (3, "")
    assert told.out.startswith("email anna: not sent: RuntimeError, a fault of this program (")


def test_a_service_with_a_wrong_secret_does_not_start(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("server.logs.begin", lambda: None)  # the logs of this process are the tests' own
    (tmp_path / "secret").write_text("wrong", "utf-8")
    (tmp_path / "daq.toml").write_text(
        '[notifications.webhooks.lab]\nurl = "https://hooks.example/"\nsecret = "secret"\n', "utf-8"
    )
    CommandLine(capsys)("serve", "--port", "0").complains(2, "notifications: secret secret: write whsec_")

"""From a form or a request to a trace, through a real server, a real worker and a mock behind a pseudo-terminal."""

from tests.server.polling import reset
from tests.server.service import Service

SHORT = {"trajectory": {"kind": "step", "amplitude": 0.02}, "joints": [1], "settle": 0.1, "hold": 0.2}


def test_the_same_key_is_the_same_experiment(service: Service) -> None:
    service.robot.post("/queue/pause")
    first = service.robot.post("/experiments", json={"spec": SHORT}, headers={"Idempotency-Key": "key of a test"})
    again = service.robot.post("/experiments", json={"spec": SHORT}, headers={"Idempotency-Key": "key of a test"})
    other = service.robot.post("/experiments", json={"priority": 3}, headers={"Idempotency-Key": "key of a test"})
    assert (first.status_code, again.status_code, other.status_code) == (201, 200, 409)
    assert first.json()["id"] == again.json()["id"]
    assert first.headers["Location"].endswith(f"/experiments/{first.json()['id']}")
    assert other.json()["detail"] == "Idempotency-Key 'key of a test' was used for another request"


def test_a_running_experiment_is_cancelled_by_a_stop_and_the_queue_waits_for_a_person(service: Service) -> None:
    long = SHORT | {"trajectory": {"kind": "pause", "duration": 60}}
    made = service.robot.post("/experiments", json={"spec": long}).json()
    following = service.robot.post("/experiments", json={"spec": SHORT}).json()
    assert service.until_recording(made["id"])["state"] == "running"
    assert service.robot.post(f"/experiments/{made['id']}/cancel").status_code == 200
    ended = service.end_of(made["id"])
    assert (ended["state"], ended["outcome"]) == ("cancelled", "stopped")
    assert ended["reason"] == "cancelled by somebody at the service's computer"
    status = service.status()
    assert status["arm"] == "stopped"
    assert status["cause"].startswith("by the service: the experiment was cancelled")
    assert status["queue"]["paused"]
    assert "look at the arm" in status["queue"]["reason"]
    assert service.robot.post("/queue/resume", json={}).status_code == 409
    assert reset(service.robot).status_code == 200
    assert service.robot.post("/queue/resume", json={}).status_code == 200
    assert service.end_of(following["id"])["state"] == "done"


def test_a_preset_may_be_named_actions_need_no_body_and_nothing_is_planned_twice(service: Service) -> None:
    assert service.robot.post("/queue/pause").status_code == 200
    known = {one["name"]: one["spec"] for one in service.robot.get("/presets").json()}
    made = service.robot.post("/experiments", json={"preset": "held-out"})
    assert (made.status_code, made.json()["spec"]) == (201, known["held-out"])
    assert service.robot.post("/experiments/preview", json={"preset": "ramp"}).json()["duration"] > 0
    nightly = service.robot.post("/schedules", json={"preset": "ramp", "cron": "0 2 * * *"}).json()
    assert (nightly["spec"], nightly["every"]) == (known["ramp"], None)
    twice = service.robot.post("/schedules", json={"preset": "ramp", "cron": "0 2 * * 1,2", "zone": nightly["zone"]})
    assert (twice.status_code, twice.json()["type"].rpartition("#")[2]) == (409, "planned-already")
    assert nightly["rule"] in twice.json()["detail"]
    assert service.robot.delete(f"/schedules/{nightly['id']}").status_code == 204
    for body in ({"preset": "rmap"}, {"preset": "ramp", "spec": SHORT}):
        assert service.robot.post("/experiments", json=body).status_code == 422
    assert service.robot.post(f"/experiments/{made.json()['id']}/cancel").status_code == 200
    assert reset(service.robot).status_code == 200
    assert service.robot.post("/queue/resume").status_code == 200
    taken = service.robot.post("/control")
    assert taken.status_code == 201
    assert service.robot.delete("/control", headers={"Control-Lease": taken.json()["lease"]}).status_code == 204


def test_a_bound_is_told_with_its_unit(service: Service) -> None:
    for motion, unit in ({"amplitude": 10}, "rad"), ({"duration": 0}, "s"), ({"duration": 1e4}, "s"):
        refused = service.robot.post("/experiments", json={"spec": {"trajectory": {"kind": "ramp"} | motion}}).json()
        name = next(iter(motion))
        assert [one["field"] for one in refused["fields"]][:1] == [f"spec.trajectory.ramp.{name}"]
        assert f" {unit} (got " in refused["fields"][0]["message"]


def test_a_motion_beyond_the_limits_is_refused_before_it_is_queued(service: Service) -> None:
    answer = service.robot.post("/experiments", json={"spec": {"trajectory": {"kind": "ramp", "amplitude": 3.4}}})
    assert answer.status_code == 422
    assert answer.headers["Content-Type"] == "application/problem+json"
    assert answer.json()["type"] == "/api/v1/problems#beyond-limits"
    assert service.robot.get("/queue").json()["queued"] == 0


# ---- presets that run as they are, and the rules of a specification


def test_a_preview_shows_where_a_motion_breaks_a_limit_and_queues_nothing(service: Service) -> None:
    spec = {"trajectory": {"kind": "ramp", "amplitude": {"1": 0.1, "2": 4.0}, "duration": 6.0}, "joints": [1, 2]}
    preview = service.robot.post("/experiments/preview", json={"spec": spec}).json()
    (found,) = [one for one in preview["violations"] if one["rule"] == "range"]
    assert (found["joint"], found["limit"]) == (2, 3.92)
    row = min(range(len(preview["time"])), key=lambda index: abs(preview["time"][index] - found["time"]))
    assert abs(preview["set_points"][row][1] - found["value"]) < 1e-6
    assert service.robot.get("/queue").json()["queued"] == 0


def test_an_experiment_with_computed_set_points_can_be_checked_and_queued(service: Service) -> None:
    """As `daq run … --feedforward … --dry-run --json` prints it."""
    ramp = {"kind": "ramp", "amplitude": 0.1, "duration": 0.4}
    error = {"1": {"rms": 0.001, "largest": 0.002}}
    spec = {
        "trajectory": {"kind": "path", "times": [0, 0.5], "positions": [[3.141592654], [3.2]]},
        "joints": [1],
        "feedforward": {
            "asked": {"trajectory": ramp, "joints": [1]},
            "model": "11f907d95fc5",
            "expected": error,
            "before": error,
        },
    }
    assert service.robot.post("/experiments/preview", json={"spec": spec}).json()["violations"] == []
    queued = service.robot.post("/experiments", json={"spec": spec}).json()
    assert queued["spec"]["feedforward"]["asked"]["trajectory"] == ramp
    refused = service.robot.post("/experiments", json={"spec": {**spec, "trajectory": ramp}})
    assert refused.status_code == 422
    assert "feedforward is for a path of computed set points" in refused.text

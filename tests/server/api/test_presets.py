"""What a form for experiments is made from: presets that run as they are, and the rules of a specification."""

from daq.contracts.experiment import ExperimentSpec
from daq.trajectories.presets import PRESETS
from tests.server.service import Service


def test_every_preset_is_there_and_can_be_run_as_it_is(service: Service) -> None:
    presets = service.robot.get("/presets").json()
    assert [preset["name"] for preset in presets] == list(PRESETS)
    for preset in presets:
        assert ExperimentSpec.model_validate(preset["spec"]) == PRESETS[preset["name"]].spec
        preview = service.robot.post("/experiments/preview", json={"spec": preset["spec"]})
        assert preview.status_code == 200, preset["name"]
        assert preview.json()["violations"] == [], preset["name"]


def test_the_rules_of_a_specification_name_bounds_and_defaults(service: Service) -> None:
    schema = service.robot.get("/spec-schema").json()
    ramp = schema["$defs"]["Ramp"]["properties"]
    assert ramp["duration"] == {
        "default": 0.65,
        "exclusiveMinimum": 0,
        "maximum": 3600,
        "title": "Duration",
        "type": "number",
    }
    assert schema["properties"]["repeats"]["maximum"] == 1000
    assert set(schema["properties"]["trajectory"]["discriminator"]["mapping"]) >= {"ramp", "sine", "sequence"}


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

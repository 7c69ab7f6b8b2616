"""Files that pyarrow, scipy and numpy write are imported by the mapping of their columns."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest
from scipy.io import savemat

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.import_choice import Choice
from daq.traces.files import open_trace

JOINTS = ["shoulder_pan", "elbow_flex", "gripper"]


def data_set(folder: Path, version: str = "v3.0", joints: list[str] = JOINTS) -> Path:
    """A data set of lerobot with two episodes of ten rows: degrees, and a gripper of 0 to 100."""
    count = len(joints)
    state = [[row + episode, *[2.0 * row] * (count - 2), 50.0] for episode in range(2) for row in range(10)]
    table = {
        "observation.state": pa.array(state, pa.list_(pa.float32(), count)),
        "action": pa.array([[first + 1.0, *others] for first, *others in state], pa.list_(pa.float32(), count)),
        "timestamp": np.tile(np.arange(10) / 30, 2).astype(np.float32),
        "episode_index": np.repeat([0, 1], 10),
        "task": ["pick"] * 20,
    }
    place = folder / "data" / "chunk-000"
    place.mkdir(parents=True)
    pyarrow.parquet.write_table(pa.table(table), place / "file-000.parquet")
    names: Any = [f"{name}.pos" for name in joints] if version == "v3.0" else {"motors": joints}
    features = {
        name: {"dtype": "float32", "shape": [count], "names": names} for name in ("observation.state", "action")
    }
    (folder / "meta").mkdir()
    (folder / "meta" / "info.json").write_text(json.dumps({"codebase_version": version, "features": features}))
    return folder


@pytest.mark.parametrize("version", ["v3.0", "v2.1"])
def test_a_data_set_of_lerobot_says_its_joints_and_asks_for_their_unit_and_the_episode(
    tmp_path: Path, version: str
) -> None:
    path = data_set(tmp_path / "pick", version)
    with pytest.raises(TraceError, match=r"is a data set of lerobot: .*not stated: the unit of position"):
        open_trace(path)
    degrees = {"position": "in deg"}
    with pytest.raises(TraceError, match="it has 2 records, episode_index 0 to 1; choose one with --where episode_ind"):
        open_trace(path, choice=Choice(map=degrees))
    trace = open_trace(path, choice=Choice(map=degrees, where="episode_index=1"))
    assert trace.record.joint_names == tuple(JOINTS)
    np.testing.assert_allclose(trace.position[3], np.radians([4, 6, 50]), rtol=1e-6)
    assert trace.set_point is not None
    np.testing.assert_allclose(trace.set_point - trace.position, [[math.radians(1), 0, 0]] * 10, atol=1e-6)
    inside = path / "data" / "chunk-000" / "file-000.parquet"
    assert open_trace(inside, choice=Choice(map=degrees, where="episode_index=1")).record.joint_names == tuple(JOINTS)


def test_ranges_of_minus_100_to_100_are_angles_by_the_calibration(tmp_path: Path) -> None:
    path = data_set(tmp_path / "pick")
    known = {name: {"id": 1, "range_min": 1000, "range_max": 3047} for name in JOINTS}
    (tmp_path / "so101.json").write_text(json.dumps(known))
    trace = open_trace(path, choice=Choice(map={"position": "in range of so101.json"}, where="episode_index=0"))
    turn = 2 * math.pi * 2047 / 4095
    np.testing.assert_allclose(trace.position[2], [2 / 200 * turn, 4 / 200 * turn, 50 / 100 * turn], rtol=1e-6)
    (tmp_path / "so101.json").write_text("{}")
    with pytest.raises(TraceError, match="has no range_min and range_max of joint 'shoulder_pan'"):
        open_trace(path, choice=Choice(map={"position": "in range of so101.json"}, where="episode_index=0"))


def test_ranges_are_angles_by_the_limits_of_a_machine_too_and_joints_that_it_lacks_are_left_out(tmp_path: Path) -> None:
    path = data_set(tmp_path / "pick")
    trace = open_trace(path, choice=Choice(map={"position": "in range of so101"}, where="episode_index=0"))
    assert trace.record.joint_names == ("shoulder_pan", "elbow_flex")
    np.testing.assert_allclose(trace.position[2], [2 / 100 * 1.9199, 4 / 100 * 1.69], rtol=1e-6)
    assert trace.set_point is not None
    assert trace.set_point[0, 0] == pytest.approx(1 / 100 * 1.9199, rel=1e-6)
    with pytest.raises(SpecError, match=r"machine '.*nobody.toml': no such file"):
        open_trace(path, choice=Choice(map={"position": "in range of nobody.toml"}, where="episode_index=0"))


def test_structures_of_matlab(tmp_path: Path) -> None:
    time = np.arange(50) / 100
    rec = {"t": time, "q": np.stack([time, 2 * time, 3 * time]), "u": {"volts": np.ones(50)}, "who": "bench"}
    savemat(tmp_path / "bench.mat", {"rec": rec})
    choice = Choice(map={"time": "rec.t", "position": "rec.q[{}] in deg"})
    trace = open_trace(tmp_path / "bench.mat", choice=choice)
    np.testing.assert_allclose(trace.position[10], np.radians([0.1, 0.2, 0.3]))
    one = Choice(map={"time": "rec.t", "position": "rec.q[1]", "drive": "rec.u.volts in V"})
    assert open_trace(tmp_path / "bench.mat", choice=one).drive is not None


def test_arrays_of_numpy_messages_in_json_and_lists_of_records(tmp_path: Path) -> None:
    time = np.arange(20) / 100
    np.savez(tmp_path / "a.npz", times=time, positions=np.stack([time, -time], axis=1), who=np.array(["x"]))
    trace = open_trace(tmp_path / "a.npz", choice=Choice(map={"time": "times", "position": "positions[{}]"}))
    np.testing.assert_array_equal(trace.position[:, 1], -time)
    entries = [{"timestamp": t, "position": 2 * t, "name": ["a"]} for t in time.tolist()]
    (tmp_path / "a.json").write_text(json.dumps({"motor": "xl330", "entries": entries}))
    mapping = {"time": "entries.timestamp", "position": "entries.position"}
    np.testing.assert_array_equal(open_trace(tmp_path / "a.json", choice=Choice(map=mapping)).position[:, 0], 2 * time)
    series = [{"t": time.tolist() * 5, "q": [n] * 100} for n in range(3)]
    (tmp_path / "b.json").write_text(json.dumps({"data": series}))
    picked = Choice(map={"time": "0.01*#", "position": "data.2.q"})
    assert open_trace(tmp_path / "b.json", choice=picked).position[0, 0] == 2


@pytest.mark.parametrize("name", ["a.parquet", "a.mat", "a.npz", "a.json"])
def test_a_damaged_file_is_one_line(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(b"PAR1" + bytes(range(200)))
    with pytest.raises(TraceError) as error:
        open_trace(tmp_path / name, choice=Choice(map={"time": "t", "position": "q"}))
    assert "\n" not in str(error.value)

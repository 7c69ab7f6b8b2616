"""The camera: pictures of a stream that is cut anywhere, and a trace that others read with its pictures in step."""

import io
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader
from PIL import Image
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from daq.contracts.machine import load_machine
from daq.traces.reader import read_trace
from daq.traces.verify import verify
from extras.camera.mjpeg import CameraError, boundary_of, parts
from extras.camera.part import Camera
from extras.camera.recorded import SCHEMA, TOPIC
from extras.camera.settings import CameraSettings
from extras.camera.synthetic import HEIGHT, WIDTH, picture
from tests.server.service import running_service

MACHINE = load_machine("ma2000")
BOUNDARY = b"--frame"
PICTURES = st.lists(st.binary(min_size=1, max_size=50).map(lambda body: b"\xff\xd8" + body), min_size=1, max_size=4)
CUTS = st.lists(st.integers(1, 40), min_size=1, max_size=30)


def _stream(bodies: list[bytes], with_length: bool) -> bytes:
    made = b""
    for body in bodies:
        length = b"Content-Length: %d\r\n" % len(body) if with_length else b""
        made += BOUNDARY + b"\r\nContent-Type: image/jpeg\r\n" + length + b"\r\n" + body + b"\r\n"
    return made + BOUNDARY + b"--\r\n"


def _cut(data: bytes, cuts: list[int]) -> Iterator[bytes]:
    place = 0
    while place < len(data):
        size = cuts[place % len(cuts)]
        yield data[place : place + size]
        place += size


@given(PICTURES, CUTS)
def test_pictures_come_whole_however_the_stream_is_cut(bodies: list[bytes], cuts: list[int]) -> None:
    assert list(parts(_cut(_stream(bodies, with_length=True), cuts), BOUNDARY)) == bodies
    plain = [body.replace(b"\r\n--frame", b"") for body in bodies]
    assert list(parts(_cut(_stream(plain, with_length=False), cuts), BOUNDARY)) == plain


@given(st.binary(max_size=400), CUTS)
def test_a_damaged_stream_gives_no_picture_that_is_none(data: bytes, cuts: list[int]) -> None:
    assert all(body.startswith(b"\xff\xd8") for body in parts(_cut(data, cuts), BOUNDARY))


def test_what_is_no_stream_of_pictures_is_refused_in_one_line() -> None:
    assert boundary_of('multipart/x-mixed-replace; boundary="--abc"') == b"--abc"
    with pytest.raises(CameraError, match="sends 'text/html'; needed is multipart"):
        boundary_of("text/html")
    with pytest.raises(CameraError, match="more than 8 MB"):
        list(parts([BOUNDARY + b"\r\nContent-Length: 99999999\r\n\r\n"], BOUNDARY))


class _Stream(BaseHTTPRequestHandler):
    """A camera made of Python's own web server: a new picture whenever the last one was taken."""

    def do_GET(self) -> None:
        self.send_response(200)
        self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=frame")
        self.end_headers()
        jpeg = io.BytesIO()
        Image.new("RGB", (64, 48), (200, 30, 30)).save(jpeg, "JPEG")
        pause = threading.Event()
        while not pause.wait(0.02):
            try:
                self.wfile.write(_stream([jpeg.getvalue()], with_length=True)[: -len(BOUNDARY) - 4])
            except OSError:
                return

    def log_message(self, format: str, *args: Any) -> None:
        """Says nothing."""


@pytest.fixture
def camera() -> Iterator[str]:
    server = HTTPServer(("127.0.0.1", 0), _Stream)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}/stream"
    server.shutdown()
    server.server_close()
    thread.join()


def test_an_experiment_is_recorded_with_pictures_that_public_readers_show(camera: str, tmp_path: Path) -> None:
    (tmp_path / "daq.toml").write_text(f'[camera]\nurl = "{camera}"\n')
    with running_service(tmp_path, "mock://?pty=1&seed=3") as service:
        service.until_connected()
        made = service.robot.post("/experiments", json={"spec": {"settle": 0.2, "hold": 0.5}}).json()
        assert service.end_of(made["id"])["state"] == "done"
        status = service.robot.get("/camera").json()
        shown = service.robot.get("/camera/picture")
        assert (status["source"], status["records"], status["problem"]) == ("mjpeg", True, "")
        assert Image.open(io.BytesIO(shown.content)).size == (64, 48)
        assert float(shown.headers["camera-age"]) >= 0
        assert service.robot.get("/camera/picture", params={"after": 2**62}).status_code == 200
    (path,) = (tmp_path / "traces").glob("*.mcap")
    trace = read_trace(path)
    assert trace.record.outcome == "complete"
    assert verify(path).trustworthy
    times, taken = _with_the_public_reader(path)
    assert len(times) >= 5
    sampled = np.asarray(taken)
    assert sampled.min() - 0.6 <= min(times)
    assert max(times) <= sampled.max() + 0.6
    assert np.all(np.diff(times) > 0)


def _with_the_public_reader(path: Path) -> tuple[list[float], list[float]]:
    """Times of the pictures and of the samples (s), read by the library `mcap`, decoded by `rosbags`, opened by
    Pillow."""
    store = get_typestore(Stores.EMPTY)
    times, sampled = [], []
    with path.open("rb") as stream:
        reader = make_reader(stream)
        assert reader.get_header().profile == "ros2"
        for schema, channel, message in reader.iter_messages(topics=[TOPIC, "/joint_states"]):
            assert schema is not None
            if channel.topic != TOPIC:
                sampled.append(message.log_time / 1e9)
                continue
            assert (schema.name, schema.encoding, channel.message_encoding) == (SCHEMA, "ros2msg", "cdr")
            if SCHEMA not in store.fielddefs:
                store.register(get_types_from_msg(schema.data.decode(), SCHEMA))
            found: Any = store.deserialize_cdr(message.data, SCHEMA)
            assert (found.frame_id, found.format) == ("camera", "jpeg")
            stamp = found.timestamp.sec + found.timestamp.nanosec / 1e9
            assert stamp == pytest.approx(message.log_time / 1e9, abs=1e-6)
            assert Image.open(io.BytesIO(found.data.tobytes())).size == (64, 48)
            times.append(stamp)
    return times, sampled


def test_the_synthetic_picture_shows_the_posture() -> None:
    rest = Image.open(io.BytesIO(picture(MACHINE, [0.0, 1.5, 0.0, 0.0, 0.0, 0.0], "a")))
    moved = Image.open(io.BytesIO(picture(MACHINE, [0.0, 0.5, 0.0, 0.0, 0.0, 0.0], "a")))
    assert rest.size == (WIDTH, HEIGHT)
    assert np.mean(np.abs(np.asarray(rest, float) - np.asarray(moved, float))) > 1


def test_an_old_posture_makes_no_new_picture_and_one_as_old_as_it_is() -> None:
    class Looks:
        """Ends a camera after so many looks at its samples."""

        left = 5

        def wait(self, _seconds: float) -> bool:
            self.left -= 1
            return self.left < 0

    place = SimpleNamespace(name="ma2000", url="mock://")
    robot = SimpleNamespace(place=place, machine=MACHINE, experiment=None)
    camera: Any = Camera(cast(Any, SimpleNamespace(robot=robot)), CameraSettings())
    camera.heard(SimpleNamespace(position=[0.0, 1.5, 0.0, 0.0, 0.0, 0.0], tick=7, host_time=12.5))
    camera._closing = Looks()
    assert [one.time for one in camera._source()] == [12.5]

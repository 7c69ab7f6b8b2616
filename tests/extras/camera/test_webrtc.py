"""A camera by WebRTC: Chromium's own implementation sends, as a camera would, to whoever asks by WHEP."""

import io
import queue
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import numpy as np
import pytest
from PIL import Image

from extras.camera.mjpeg import CameraError
from extras.camera.webrtc import frames, jpeg
from tests.server.dashboard.browser import OPTIONS, chromium, playwright

PATIENCE = 20.0
ON_LOOPBACK = [OPTIONS[0] + ",WebRtcHideLocalIpsWithMdns", "--allow-loopback-in-peer-connection"]
PAGE = b"""<!doctype html><canvas id="picture" width="320" height="240"></canvas><script>
const pen = picture.getContext('2d');
setInterval(() => { pen.fillStyle = '#c81e1e'; pen.fillRect(0, 0, 320, 240); }, 30);
(async () => {
    const offer = await (await fetch('/offer')).text();
    const connection = new RTCPeerConnection();
    picture.captureStream(30).getTracks().forEach((track) => connection.addTrack(track));
    await connection.setRemoteDescription({ type: 'offer', sdp: offer });
    await connection.setLocalDescription();
    while (connection.iceGatheringState !== 'complete')
        await new Promise((done) => (connection.onicegatheringstatechange = done));
    await fetch('/answer', { method: 'POST', body: connection.localDescription.sdp });
})();
</script>"""


class _Camera:
    """The two requests of WHEP, passed on to the page, and the answer to them."""

    def __init__(self) -> None:
        self.offers: queue.Queue[bytes] = queue.Queue()
        self.answers: queue.Queue[bytes] = queue.Queue()
        self.ended = threading.Event()
        camera = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                self._tell(200, camera.offers.get(timeout=PATIENCE) if self.path == "/offer" else PAGE)

            def do_POST(self) -> None:
                body = self.rfile.read(int(self.headers["Content-Length"]))
                if self.path == "/answer":
                    camera.answers.put(body)
                    self._tell(200, b"")
                elif self.path == "/whep":
                    camera.offers.put(body)
                    self._tell(201, camera.answers.get(timeout=PATIENCE), ("Location", "/session"))
                else:
                    self._tell(404 if self.path == "/none" else 201, b"no description")

            def do_DELETE(self) -> None:
                camera.ended.set()
                self._tell(200, b"")

            def _tell(self, status: int, body: bytes, *more: tuple[str, str]) -> None:
                self.send_response(status)
                for name, value in (("Content-Length", str(len(body))), ("Content-Type", "text/html"), *more):
                    self.send_header(name, value)
                self.end_headers()
                self.wfile.write(body)

            def log_message(self, format: str, *args: Any) -> None:
                """Says nothing."""

        self.server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.place = f"127.0.0.1:{self.server.server_port}"


@pytest.fixture
def camera(monkeypatch: pytest.MonkeyPatch) -> Iterator[_Camera]:
    """A camera; nothing leaves this computer's loopback."""
    monkeypatch.setattr("aioice.ice.get_host_addresses", lambda **_: ["127.0.0.1"])
    made = _Camera()
    thread = threading.Thread(target=made.server.serve_forever, daemon=True)
    thread.start()
    yield made
    made.server.shutdown()
    made.server.server_close()
    thread.join()


@pytest.mark.browser
def test_what_a_browser_sends_is_received_and_the_session_is_ended(camera: _Camera) -> None:
    taken: list[bytes] = []

    def take() -> None:
        """As the thread of a camera does, beside the loop of the browser's driver."""
        for frame in frames(f"whep://{camera.place}/whep"):
            taken.append(jpeg(frame))
            if len(taken) == 5:
                return

    thread = threading.Thread(target=take)
    with playwright() as driver, chromium(driver, *ON_LOOPBACK) as browser:
        browser.new_page().goto(f"http://{camera.place}/")
        thread.start()
        thread.join(PATIENCE)
    assert len(taken) == 5
    picture = Image.open(io.BytesIO(taken[-1]))
    assert picture.size == (320, 240)
    red, *others = np.asarray(picture, float).mean(axis=(0, 1))  # codecs differ in the matrix of their colours
    assert red == pytest.approx(200, abs=20)
    assert max(others) < 60
    assert camera.ended.wait(PATIENCE)


def test_an_answer_without_a_session_is_refused_in_one_line(camera: _Camera) -> None:
    for path, line in (("none", "answers 404; allowed is 201"), ("text", "no WebRTC session with video")):
        with pytest.raises(CameraError, match=line):
            next(frames(f"whep://{camera.place}/{path}"))

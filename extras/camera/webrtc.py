"""Receives a camera's video by WebRTC, asked for by WHEP: one HTTP request that offers a session, as MediaMTX and
go2rtc answer it. The receiver is aiortc, which is installed for this alone.

No STUN server is asked: the camera is in the network of the service.
"""

from __future__ import annotations

import asyncio
import io
from collections.abc import Iterator
from contextlib import suppress
from typing import TYPE_CHECKING
from urllib.parse import urljoin, urlsplit

from daq.contracts.extras import require_extra
from extras.camera.mjpeg import CONNECT, SILENCE, CameraError

if TYPE_CHECKING:
    import httpx
    from aiortc import MediaStreamTrack, RTCPeerConnection, RTCRtpTransceiver
    from av import VideoFrame
    from PIL.Image import Image

SCHEMES = {"whep": "http", "wheps": "https"}
"""Schemes of such a camera, as MediaMTX writes them, and those of the request."""
QUALITY = 85
WAITING = 0.001
"""Longest wait (s) for a frame that has been decoded already."""


def frames(url: str) -> Iterator[VideoFrame]:
    """Yields frames as they come; of those that have come meanwhile, the newest. Raises CameraError, MissingExtraError.

    It has an event loop of its own, which runs while a frame is waited for.
    """
    require_extra("webrtc", "a camera by WebRTC", "aiortc")
    import httpx
    from aiortc import RTCSessionDescription
    from aiortc.exceptions import InvalidAccessError
    from aiortc.mediastreams import MediaStreamError

    address = f"{SCHEMES[urlsplit(url).scheme]}{url[url.index(':') :]}"
    with asyncio.Runner() as runner, httpx.Client(timeout=httpx.Timeout(SILENCE, connect=CONNECT)) as client:
        connection, video = runner.run(_offered())
        session = None
        try:
            answer, session = _asked(client, address, connection.localDescription.sdp)
            runner.run(connection.setRemoteDescription(RTCSessionDescription(answer, "answer")))
            while True:
                yield runner.run(_newest(video.receiver.track))
        except httpx.HTTPError as error:
            raise CameraError(f"the camera does not answer: {type(error).__name__}") from None
        except TimeoutError:
            raise CameraError(f"the camera sends no picture by WebRTC for {SILENCE:g} s") from None
        except MediaStreamError:
            raise CameraError("the camera ended its stream") from None
        except (ValueError, KeyError, IndexError, InvalidAccessError) as error:  # of an answer that is no description
            raise CameraError(f"the camera's answer is no WebRTC session with video: {type(error).__name__}") from None
        finally:
            runner.run(connection.close())
            if session is not None:
                with suppress(httpx.HTTPError):
                    client.delete(session)


def jpeg(frame: VideoFrame) -> bytes:
    """Returns a frame as JPEG."""
    stream = io.BytesIO()
    image: Image = frame.to_image()
    image.save(stream, "JPEG", quality=QUALITY)
    return stream.getvalue()


async def _offered() -> tuple[RTCPeerConnection, RTCRtpTransceiver]:
    """Returns a connection that offers to receive video, and what receives it."""
    from aiortc import RTCConfiguration, RTCPeerConnection

    connection = RTCPeerConnection(RTCConfiguration(iceServers=[]))
    video = connection.addTransceiver("video", direction="recvonly")
    await connection.setLocalDescription(await connection.createOffer())
    return connection, video


def _asked(client: httpx.Client, address: str, offer: str) -> tuple[str, str | None]:
    """Returns the camera's description, and the address at which the session ends. Raises CameraError, HTTPError."""
    answer = client.post(address, content=offer, headers={"Content-Type": "application/sdp"})
    if not answer.is_success:
        raise CameraError(f"the camera answers {answer.status_code}; allowed is 201, with a session of WHEP")
    session = urljoin(address, answer.headers.get("location", ""))
    is_there = "location" in answer.headers and urlsplit(session)[:2] == urlsplit(address)[:2]
    return answer.text, session if is_there else None


async def _newest(track: MediaStreamTrack) -> VideoFrame:
    """Waits for a frame; those that have come before it, while nobody took them, are left out."""
    frame = await asyncio.wait_for(track.recv(), SILENCE)
    with suppress(TimeoutError):
        while True:
            frame = await asyncio.wait_for(track.recv(), WAITING)
    return frame  # a track of video

"""Reads MJPEG: an HTTP response of type multipart/x-mixed-replace, each part a JPEG (RFC 2046, section 5.1)."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from daq.contracts.errors import DaqError

MOST = 8 << 20
"""Largest picture (bytes), an assumption: 4 K at high quality has 3 MB."""
MOST_HEAD = 1 << 14
"""Longest head of a part (bytes)."""
JPEG = b"\xff\xd8"
CONNECT, SILENCE = 5.0, 10.0
"""Longest waits (s) for the connection, and for the next bytes."""


class CameraError(DaqError):
    """The camera gives no pictures; the text is one line."""


def pictures(url: str) -> Iterator[bytes]:
    """Yields JPEGs as they come, until the camera ends the stream. Raises CameraError."""
    import httpx  # slow to import, and few services have a camera

    limits = httpx.Timeout(SILENCE, connect=CONNECT)
    try:
        with httpx.stream("GET", url, timeout=limits, follow_redirects=False) as answer:
            if answer.status_code != httpx.codes.OK:
                raise CameraError(f"the camera answers {answer.status_code}; allowed is 200, with an MJPEG stream")
            yield from parts(answer.iter_bytes(), boundary_of(answer.headers.get("content-type", "")))
    except httpx.HTTPError as error:
        raise CameraError(f"the camera does not answer: {type(error).__name__}") from None


def boundary_of(content_type: str) -> bytes:
    """Returns the boundary of the parts. Raises CameraError for another type."""
    found = re.fullmatch(
        r'multipart/[\w.-]+\s*;.*?\bboundary="?([^";,\s]{1,70})"?.*', content_type.strip(), re.IGNORECASE
    )
    if found is None:
        raise CameraError(f"the camera sends {content_type[:60]!r}; needed is multipart/x-mixed-replace")
    return b"--" + found[1].encode("latin-1").removeprefix(b"--")


def parts(chunks: Iterable[bytes], boundary: bytes) -> Iterator[bytes]:
    """Yields the pictures in a stream that is cut at any place. Other parts are left out. Raises CameraError for one
    that is too large."""
    buffer = bytearray()
    for chunk in chunks:
        buffer += chunk
        while (found := _first(buffer, boundary)) is not None:
            body, end = found
            if body.startswith(JPEG):
                yield body
            del buffer[:end]
        if len(buffer) > MOST + MOST_HEAD:
            raise CameraError(f"the camera sends a picture of more than {MOST >> 20} MB")


def _first(buffer: bytearray, boundary: bytes) -> tuple[bytes, int] | None:
    """Returns the first whole part, and where the next begins; None while it is not whole."""
    begin = buffer.find(boundary)
    if begin < 0:
        return None
    head_end = buffer.find(b"\r\n\r\n", begin)
    if head_end < 0:
        if len(buffer) - begin > MOST_HEAD:
            raise CameraError("the camera sends a part without an end of its head")
        return None
    start = head_end + 4
    length = re.search(rb"content-length:\s*(\d{1,9})", bytes(buffer[begin:head_end]), re.IGNORECASE)
    if length is not None:
        end = start + int(length[1])
        if int(length[1]) > MOST:
            raise CameraError(f"the camera sends a picture of more than {MOST >> 20} MB")
        return None if len(buffer) < end else (bytes(buffer[start:end]), end)
    end = buffer.find(b"\r\n" + boundary, start)
    return None if end < 0 else (bytes(buffer[start:end]), end)

"""The configuration of the camera. No request can change it, so no request makes the service fetch an address."""

from __future__ import annotations

from typing import Annotated
from urllib.parse import urlsplit

from pydantic import Field, field_validator

from daq.config.section import Section
from extras.camera.webrtc import SCHEMES

SYNTHETIC = "synthetic"
ALLOWED = "is not a URL of a camera; write http://host/stream, whep://host/camera/whep, or synthetic"


class CameraSettings(Section):
    """Section `[camera]`. Without a `url`, a mock has a synthetic picture that is not recorded, and a real arm none."""

    SHOWN = frozenset(["rate", "most_size"])

    url: Annotated[str, Field(max_length=500)] | None = None
    """URL of an MJPEG stream (`http://host/stream`) or of one by WebRTC (`whep://host/camera/whep`), or `synthetic`.
    `{robot}` stands for the arm's name."""
    record: bool = True
    """Whether pictures are recorded into the traces of experiments, if there is a `url`."""
    rate: Annotated[float, Field(gt=0, le=60)] = 10.0
    """Most pictures per second that are kept; a faster source is thinned."""
    most_size: Annotated[int, Field(ge=1, le=1024)] = 200
    """Most pictures (MB) in one trace; the rest of a longer record has none."""

    @field_validator("url")
    @classmethod
    def _is_address(cls, url: str | None) -> str | None:
        """Raises ValueError for an invalid URL, without repeating it: it may have a password."""
        if url is None or url == SYNTHETIC:
            return url
        try:
            parts = urlsplit(url)
            _ = parts.port
        except ValueError:
            raise ValueError(ALLOWED) from None
        if parts.scheme not in ("http", "https", *SCHEMES) or not parts.hostname:
            raise ValueError(ALLOWED)
        return url

"""The synthetic picture of a mock: the arm from its side, drawn from the newest sample."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence

import numpy as np

from daq.contracts.machine import Machine
from daq.trajectories.kinematics import link_ends

WIDTH, HEIGHT = 480, 360
FLOOR = 290
"""Row (px) of the base."""
VIEW = math.radians(35.0)
"""Angle of the view about the vertical, so that the waist's motion shows."""
QUALITY = 80
BACK, GROUND, ARM, JOINT, INK = (38, 46, 56), (58, 68, 80), (232, 170, 66), (250, 250, 250), (200, 210, 220)


def picture(machine: Machine, position: Sequence[float], label: str) -> bytes:
    """Returns a JPEG of the arm at a posture (rad, m), with a label."""
    from PIL import Image, ImageDraw  # slow to import, and not every service shows a camera

    angles = np.zeros((1, len(machine.joints)))
    angles[0, : len(position)] = position
    ends = link_ends(machine, angles)[0]
    reach = sum(abs(one.geometry.a.value) + abs(one.geometry.d.value) for one in machine.joints) or 1.0
    scale = 0.75 * FLOOR / reach
    across = ends[:, 0] * math.cos(VIEW) + ends[:, 1] * math.sin(VIEW)
    xy = np.column_stack([WIDTH / 2 + scale * across, FLOOR - 40 - scale * ends[:, 2]])
    points = [(WIDTH / 2, FLOOR), (WIDTH / 2, FLOOR - 40.0), *map(tuple, xy.tolist())]
    image = Image.new("RGB", (WIDTH, HEIGHT), BACK)
    draw = ImageDraw.Draw(image)
    draw.rectangle((0, FLOOR, WIDTH, HEIGHT), fill=GROUND)
    draw.ellipse((WIDTH / 2 - 46, FLOOR - 9, WIDTH / 2 + 46, FLOOR + 9), fill=ARM)
    draw.line(points, fill=ARM, width=14, joint="curve")
    for x, y in points[1:]:
        draw.ellipse((x - 6, y - 6, x + 6, y + 6), fill=JOINT)
    draw.text((10, HEIGHT - 26), f"synthetic camera · {label}", fill=INK, font_size=16)
    stream = io.BytesIO()
    image.save(stream, "JPEG", quality=QUALITY)
    return stream.getvalue()

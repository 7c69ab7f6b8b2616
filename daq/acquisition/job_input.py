"""The job, read from the parent's pipe; what follows it there belongs to the guardian."""

from __future__ import annotations

import os

from pydantic import ValidationError

from daq.acquisition.messages import Job
from daq.contracts.errors import SpecError
from daq.runner.arm_control import StoppedError
from firmware_protocol.invalid import first_invalid

LONGEST_JOB = 256 << 20
"""Bytes: a recorded path of hours."""


def read_job(descriptor: int) -> Job:
    """The job of the first line.

    Raises SpecError when there is none, or it is not valid; StoppedError when the parent wants a stop already.
    """
    data = bytearray()
    while b"\n" not in data:
        piece = os.read(descriptor, 65536)
        if not piece:
            raise SpecError("job: the input ended before the job was complete")
        data += piece
        if len(data) > LONGEST_JOB:
            raise SpecError(f"job: longer than {LONGEST_JOB} bytes")
    line, _, rest = bytes(data).partition(b"\n")
    if rest:
        raise StoppedError("by the program that started the run", "stopped before it began; nothing moved")
    try:
        return Job.model_validate_json(line)
    except ValidationError as error:
        first = first_invalid(error)
        raise SpecError(f"job: {first.where('text')}: {first.message}") from error

"""The four ways of teaching of the original: drive-through, lead by the nose, off-line steps, continuous path."""

from daq.teaching.arm import TeachableArm, TeachingError
from daq.teaching.jog import DEAD_MAN, JOG_SPEED, JogCommand, Jogger, JogStep, jog
from daq.teaching.lead import lead_by_nose
from daq.teaching.program import Program, load_program, parse_program, program_text, save_program
from daq.teaching.program_plan import Performer, PlannedInstruction, check_program, plan_program, run_program
from daq.teaching.recording import RecordedPath, playback

__all__ = [
    "DEAD_MAN",
    "JOG_SPEED",
    "JogCommand",
    "JogStep",
    "Jogger",
    "Performer",
    "PlannedInstruction",
    "Program",
    "RecordedPath",
    "TeachableArm",
    "TeachingError",
    "check_program",
    "jog",
    "lead_by_nose",
    "load_program",
    "parse_program",
    "plan_program",
    "playback",
    "program_text",
    "run_program",
    "save_program",
]

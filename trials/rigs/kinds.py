"""The kinds of test rig: properties of an arm, its controller, its sensors and its records.

TUNING and REPORTING must never mix. **No reporting kind may be looked at during tuning of the diagnosis**: not its
records, its answers, or its rates. A kind that was looked at moves to REPORTED, which may be used for tuning, and
another takes its place.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from trials.rigs.parameters import BOARD, BRISTLE, CASCADE, PID, SWITCH, TANH

VOLTS, CURRENT = "volts", "current"


@dataclass(frozen=True)
class Kind:
    """A kind of test rig. Values are drawn from every range and chosen from every tuple.

    Args:
        joints: number of joints. controller, rate: of the loop, Hz. drive: what the controller commands.
        bits: of encoders over their range. noise: rms in counts of white noise. coloured: rms in counts of noise with
            a corner at 3 Hz. outliers: share of readings. rounding: share of the largest drive that it is rounded to.
        limit: largest output of the controller as a share of the supply, None for all.
        contacts: laws of dry friction. laws: which of the three laws an effect takes, drawn from these.
        rubs: whether healthy arms have Coulomb friction, which the file then states.
        motions: kinds of motion. duration: s of a record. recorded: columns besides the position.
        known_loop: whether the machine file states the controller. body: links are stated as bodies, not as rods.
        horizontal: gravity along the axes of a planar arm, as on a table.
    """

    joints: int
    controller: int
    rate: tuple[float, ...]
    drive: str = VOLTS
    bits: tuple[int, ...] = (14,)
    noise: float = 0.3
    coloured: float = 0.0
    outliers: float = 0.0
    rounding: float = 0.0
    limit: float | None = None
    contacts: tuple[int, ...] = (SWITCH,)
    laws: tuple[int, ...] = (0, 1, 2)
    rubs: bool = True
    motions: tuple[str, ...] = ("ramps",)
    duration: float = 12.0
    recorded: tuple[str, ...] = ("set_point", "drive")
    known_loop: bool = True
    body: bool = False
    horizontal: bool = False


_AXIS = Kind(1, PID, (200.0,))
_PLANAR = Kind(2, PID, (200.0,), bits=(14, 16))
_ANTHROPOMORPHIC = Kind(3, PID, (100.0,), bits=(12, 14))

TUNING: dict[str, Kind] = {
    "axis-pid": replace(_AXIS, contacts=(TANH, SWITCH), motions=("ramps", "sines")),
    "axis-rounded": replace(_AXIS, rounding=0.004, limit=0.6, rate=(100.0, 200.0), motions=("ramps", "via points")),
    "axis-current": replace(
        _AXIS, drive=CURRENT, rate=(500.0,), bits=(18,), contacts=(BRISTLE,), motions=("sines",), known_loop=False
    ),
    "planar-pid": replace(_PLANAR, contacts=(SWITCH, BRISTLE), motions=("ramps", "via points")),
    "planar-board": replace(_PLANAR, controller=BOARD, rate=(50.0,), bits=(12,), motions=("ramps",)),
    "planar-torques": replace(
        _PLANAR,
        drive=CURRENT,
        known_loop=False,
        recorded=("drive", "velocity"),
        bits=(16,),
        body=True,
        contacts=(TANH,),
        motions=("sines", "via points"),
        rate=(250.0,),
    ),
    "arm-rounded": replace(
        _ANTHROPOMORPHIC, rounding=0.004, limit=0.5, contacts=(TANH,), laws=(1,), noise=0.0, motions=("ramps",)
    ),
}
"""Kinds that may be used for tuning the diagnosis."""

REPORTED: dict[str, Kind] = {
    "axis-board-table": replace(
        _AXIS, controller=BOARD, rate=(50.0,), bits=(10, 11), horizontal=True, motions=("ramps", "sweep")
    ),
    "axis-outliers": replace(_AXIS, outliers=0.003, coloured=0.5, bits=(13,), motions=("sines", "via points")),
    "planar-coloured": replace(_PLANAR, coloured=0.8, noise=0.2, contacts=(TANH,), motions=("random steps", "sines")),
    "arm-current": replace(
        _ANTHROPOMORPHIC,
        drive=CURRENT,
        rate=(250.0,),
        bits=(16,),
        contacts=(BRISTLE,),
        motions=("via points",),
        recorded=("drive",),
        known_loop=False,
        body=True,
    ),
    "six-torques": replace(
        _ANTHROPOMORPHIC,
        joints=6,
        drive=CURRENT,
        rate=(1000.0,),
        bits=(19,),
        contacts=(TANH, BRISTLE),
        recorded=("drive", "velocity"),
        known_loop=False,
        body=True,
        motions=("sines",),
    ),
    "axis-cascade": replace(
        _AXIS, controller=CASCADE, rate=(400.0,), bits=(17,), contacts=(BRISTLE,), motions=("via points", "steps")
    ),
    "axis-steps": replace(
        _AXIS, rate=(250.0,), bits=(15,), contacts=(TANH, BRISTLE), motions=("steps", "random steps"), body=True
    ),
    "axis-current-table": replace(
        _AXIS,
        drive=CURRENT,
        rate=(400.0,),
        bits=(20,),
        contacts=(SWITCH,),
        horizontal=True,
        motions=("sines", "via points"),
        recorded=("drive",),
        known_loop=False,
    ),
    "planar-current": replace(
        _PLANAR,
        drive=CURRENT,
        rate=(400.0,),
        bits=(17,),
        contacts=(SWITCH,),
        motions=("sines", "via points"),
        recorded=("set_point", "drive", "velocity"),
        known_loop=False,
    ),
    "planar-cascade": replace(
        _PLANAR, controller=CASCADE, rate=(500.0,), bits=(18, 20), rounding=0.001, motions=("sweep", "via points")
    ),
    "axis-volts-table": replace(
        _AXIS, rate=(125.0,), bits=(16,), contacts=(SWITCH, BRISTLE), horizontal=True, motions=("sweep", "sines")
    ),
    "planar-steps": replace(_PLANAR, contacts=(TANH, SWITCH), motions=("steps", "random steps"), body=True),
    "planar-current-table": replace(
        _PLANAR,
        drive=CURRENT,
        rate=(300.0,),
        bits=(15,),
        contacts=(BRISTLE,),
        horizontal=True,
        motions=("random steps", "sines"),
        known_loop=False,
    ),
    "arm-current-ramps": replace(
        _ANTHROPOMORPHIC,
        drive=CURRENT,
        rate=(500.0,),
        bits=(17,),
        contacts=(TANH,),
        motions=("ramps", "via points"),
        known_loop=False,
    ),
    "six-volts": replace(
        _ANTHROPOMORPHIC, joints=6, bits=(14, 16), rounding=0.002, contacts=(SWITCH,), motions=("via points",)
    ),
    "axis-cascade-table": replace(
        _AXIS, controller=CASCADE, rate=(250.0,), bits=(18,), contacts=(SWITCH,), horizontal=True, motions=("sines",)
    ),
    "planar-volts": replace(_PLANAR, rate=(400.0,), bits=(18,), contacts=(BRISTLE,), motions=("sines", "random steps")),
    "arm-volts": replace(_ANTHROPOMORPHIC, rate=(200.0,), bits=(15,), contacts=(SWITCH,), motions=("sweep", "ramps")),
    "planar-current-steps": replace(
        _PLANAR,
        drive=CURRENT,
        rate=(500.0,),
        bits=(16,),
        contacts=(TANH,),
        motions=("steps", "random steps"),
        recorded=("drive", "velocity"),
        known_loop=False,
    ),
    "axis-current-body": replace(
        _AXIS,
        drive=CURRENT,
        rate=(250.0,),
        bits=(19,),
        contacts=(BRISTLE,),
        body=True,
        motions=("sweep", "via points"),
        known_loop=False,
    ),
    "axis-volts-body": replace(
        _AXIS, rate=(300.0,), bits=(17,), contacts=(TANH, BRISTLE), body=True, motions=("via points", "sweep")
    ),
    "planar-cascade-steps": replace(
        _PLANAR, controller=CASCADE, rate=(400.0,), bits=(16,), contacts=(SWITCH,), motions=("steps", "sines")
    ),
    "planar-volts-rounded": replace(
        _PLANAR, rate=(250.0,), bits=(17,), rounding=0.002, limit=0.7, contacts=(BRISTLE,), motions=("via points",)
    ),
    "arm-cascade": replace(
        _ANTHROPOMORPHIC,
        controller=CASCADE,
        rate=(250.0,),
        bits=(17,),
        contacts=(TANH,),
        motions=("via points", "sines"),
    ),
    "planar-current-sweep": replace(
        _PLANAR,
        drive=CURRENT,
        rate=(400.0,),
        bits=(18,),
        contacts=(SWITCH,),
        motions=("sweep", "ramps"),
        recorded=("drive",),
        known_loop=False,
    ),
    "six-current": replace(
        _ANTHROPOMORPHIC,
        joints=6,
        drive=CURRENT,
        rate=(500.0,),
        bits=(18,),
        contacts=(SWITCH,),
        body=True,
        motions=("sines", "via points"),
        known_loop=False,
    ),
    "axis-rounded-sines": replace(
        _AXIS, rate=(250.0,), bits=(16,), rounding=0.003, limit=0.6, contacts=(SWITCH,), motions=("sines", "sweep")
    ),
    "planar-volts-table": replace(
        _PLANAR, rate=(200.0,), bits=(16,), contacts=(TANH,), horizontal=True, motions=("via points", "sines")
    ),
    "planar-cascade-body": replace(
        _PLANAR, controller=CASCADE, rate=(300.0,), bits=(17,), contacts=(BRISTLE,), body=True, motions=("sweep",)
    ),
    "arm-steps": replace(
        _ANTHROPOMORPHIC, rate=(250.0,), bits=(16,), contacts=(TANH, BRISTLE), motions=("steps", "via points")
    ),
    "axis-current-ramps": replace(
        _AXIS, drive=CURRENT, rate=(300.0,), bits=(17,), contacts=(TANH,), motions=("ramps",), known_loop=False
    ),
    "six-cascade": replace(
        _ANTHROPOMORPHIC,
        joints=6,
        controller=CASCADE,
        rate=(250.0,),
        bits=(17,),
        contacts=(SWITCH,),
        motions=("via points", "sines"),
    ),
    "axis-cascade-rounded": replace(
        _AXIS,
        controller=CASCADE,
        rate=(250.0,),
        bits=(16,),
        rounding=0.002,
        contacts=(TANH,),
        motions=("ramps", "sines"),
    ),
    "axis-board-steps": replace(
        _AXIS, controller=BOARD, rate=(50.0,), bits=(12,), contacts=(BRISTLE,), motions=("steps", "via points")
    ),
    "planar-coloured-via": replace(
        _PLANAR, rate=(250.0,), bits=(15,), coloured=0.5, noise=0.2, contacts=(SWITCH,), motions=("via points",)
    ),
    "arm-sweep": replace(_ANTHROPOMORPHIC, rate=(200.0,), bits=(15,), contacts=(BRISTLE,), motions=("sweep", "ramps")),
    "arm-current-body": replace(
        _ANTHROPOMORPHIC,
        drive=CURRENT,
        rate=(500.0,),
        bits=(18,),
        contacts=(TANH,),
        motions=("sines", "via points"),
        recorded=("drive", "velocity"),
        known_loop=False,
        body=True,
    ),
    "six-rounded": replace(
        _ANTHROPOMORPHIC,
        joints=6,
        rate=(250.0,),
        bits=(17,),
        rounding=0.002,
        contacts=(SWITCH,),
        motions=("via points", "random steps"),
    ),
    "axis-coloured": replace(
        _AXIS, rate=(400.0,), bits=(18,), coloured=0.5, noise=0.3, contacts=(SWITCH,), motions=("steps", "sines")
    ),
    "axis-current-steps": replace(
        _AXIS,
        drive=CURRENT,
        rate=(500.0,),
        bits=(16,),
        contacts=(SWITCH,),
        motions=("random steps", "ramps"),
        known_loop=False,
    ),
    "planar-board-sines": replace(
        _PLANAR, controller=BOARD, rate=(50.0,), bits=(14,), contacts=(TANH,), motions=("sines", "via points")
    ),
    "planar-cascade-ramps": replace(
        _PLANAR,
        controller=CASCADE,
        rate=(200.0,),
        bits=(15,),
        coloured=0.3,
        contacts=(TANH,),
        motions=("ramps", "steps"),
    ),
    "arm-cascade-body": replace(
        _ANTHROPOMORPHIC,
        controller=CASCADE,
        rate=(400.0,),
        bits=(17,),
        contacts=(SWITCH,),
        body=True,
        motions=("sines", "sweep"),
    ),
    "arm-current-table": replace(
        _ANTHROPOMORPHIC,
        drive=CURRENT,
        rate=(250.0,),
        bits=(18,),
        contacts=(BRISTLE,),
        horizontal=True,
        motions=("via points", "steps"),
        recorded=("drive",),
        known_loop=False,
    ),
    "six-current-ramps": replace(
        _ANTHROPOMORPHIC,
        joints=6,
        drive=CURRENT,
        rate=(250.0,),
        bits=(19,),
        contacts=(TANH,),
        motions=("ramps", "sines"),
        known_loop=False,
    ),
    "axis-volts-random": replace(
        _AXIS, rate=(300.0,), bits=(17,), contacts=(TANH,), motions=("random steps", "via points")
    ),
    "planar-current-via": replace(
        _PLANAR, drive=CURRENT, rate=(400.0,), bits=(18,), contacts=(SWITCH,), motions=("via points",), known_loop=False
    ),
    "planar-rounded-sweep": replace(
        _PLANAR, rate=(250.0,), bits=(16,), rounding=0.003, limit=0.7, contacts=(BRISTLE,), motions=("sweep", "sines")
    ),
    "arm-volts-ramps": replace(
        _ANTHROPOMORPHIC, rate=(200.0,), bits=(16,), contacts=(TANH, SWITCH), body=True, motions=("ramps", "sines")
    ),
    "arm-cascade-steps": replace(
        _ANTHROPOMORPHIC, controller=CASCADE, rate=(250.0,), bits=(17,), contacts=(BRISTLE,), motions=("steps",)
    ),
    "six-volts-via": replace(
        _ANTHROPOMORPHIC, joints=6, rate=(500.0,), bits=(19,), contacts=(BRISTLE,), motions=("via points", "ramps")
    ),
    "axis-cascade-sweep": replace(
        _AXIS, controller=CASCADE, rate=(400.0,), bits=(18,), contacts=(SWITCH,), motions=("sweep", "random steps")
    ),
    "planar-volts-ramps": replace(
        _PLANAR, rate=(300.0,), bits=(17,), contacts=(TANH,), motions=("ramps", "via points")
    ),
    "planar-cascade-random": replace(
        _PLANAR, controller=CASCADE, rate=(500.0,), bits=(16,), contacts=(BRISTLE,), motions=("random steps",)
    ),
    "arm-current-sines": replace(
        _ANTHROPOMORPHIC,
        drive=CURRENT,
        rate=(400.0,),
        bits=(18,),
        contacts=(SWITCH,),
        body=True,
        motions=("sines", "steps"),
        known_loop=False,
    ),
    "arm-rounded-via": replace(
        _ANTHROPOMORPHIC,
        rounding=0.002,
        limit=0.8,
        rate=(250.0,),
        bits=(18,),
        contacts=(TANH,),
        motions=("via points",),
    ),
    "six-cascade-sweep": replace(
        _ANTHROPOMORPHIC,
        joints=6,
        controller=CASCADE,
        rate=(300.0,),
        bits=(20,),
        contacts=(SWITCH,),
        motions=("sweep", "via points"),
    ),
    "axis-current-sweep": replace(
        _AXIS,
        drive=CURRENT,
        rate=(500.0,),
        bits=(17,),
        contacts=(BRISTLE,),
        motions=("sweep", "ramps"),
        known_loop=False,
    ),
    "planar-current-ramps": replace(
        _PLANAR,
        drive=CURRENT,
        rate=(300.0,),
        bits=(17,),
        contacts=(SWITCH,),
        motions=("ramps", "sines"),
        known_loop=False,
        body=True,
    ),
    "planar-cascade-via": replace(
        _PLANAR, controller=CASCADE, rate=(400.0,), bits=(17,), contacts=(TANH,), motions=("via points", "steps")
    ),
    "arm-volts-random": replace(
        _ANTHROPOMORPHIC, rate=(200.0,), bits=(17,), contacts=(BRISTLE,), motions=("random steps", "ramps")
    ),
    "arm-cascade-sines": replace(
        _ANTHROPOMORPHIC,
        controller=CASCADE,
        rate=(300.0,),
        bits=(18,),
        contacts=(TANH,),
        motions=("sines", "sweep"),
    ),
    "six-current-steps": replace(
        _ANTHROPOMORPHIC,
        joints=6,
        drive=CURRENT,
        rate=(400.0,),
        bits=(20,),
        contacts=(BRISTLE,),
        body=True,
        motions=("steps", "sines"),
        known_loop=False,
    ),
    "axis-volts-via": replace(
        _AXIS, rate=(300.0,), bits=(17,), contacts=(BRISTLE,), motions=("via points", "sines"), body=True
    ),
    "planar-volts-sines": replace(
        _PLANAR, rate=(400.0,), bits=(16,), contacts=(SWITCH,), motions=("sines", "random steps")
    ),
    "planar-cascade-sweep": replace(
        _PLANAR,
        controller=CASCADE,
        rate=(300.0,),
        bits=(18,),
        contacts=(BRISTLE,),
        motions=("sweep", "ramps"),
        body=True,
    ),
    "arm-current-random": replace(
        _ANTHROPOMORPHIC,
        drive=CURRENT,
        rate=(500.0,),
        bits=(17,),
        contacts=(TANH,),
        motions=("random steps", "via points"),
        known_loop=False,
    ),
    "arm-volts-sweep": replace(
        _ANTHROPOMORPHIC, rate=(250.0,), bits=(18,), contacts=(SWITCH,), body=True, motions=("sweep", "steps")
    ),
    "six-volts-ramps": replace(
        _ANTHROPOMORPHIC, joints=6, rate=(400.0,), bits=(19,), contacts=(TANH,), motions=("ramps", "via points")
    ),
    "axis-cascade-random": replace(
        _AXIS, controller=CASCADE, rate=(250.0,), bits=(16,), contacts=(TANH,), motions=("random steps", "sines")
    ),
    "planar-current-mixed": replace(
        _PLANAR,
        drive=CURRENT,
        rate=(200.0,),
        bits=(15,),
        contacts=(BRISTLE,),
        motions=("via points", "steps"),
        known_loop=False,
        horizontal=True,
    ),
    "planar-pid-random": replace(
        _PLANAR, rate=(300.0,), bits=(17,), contacts=(TANH,), motions=("random steps", "ramps")
    ),
    "arm-cascade-random": replace(
        _ANTHROPOMORPHIC,
        controller=CASCADE,
        rate=(300.0,),
        bits=(16,),
        contacts=(SWITCH,),
        motions=("random steps", "sweep"),
    ),
    "arm-volts-mixed": replace(
        _ANTHROPOMORPHIC, rate=(150.0,), bits=(15,), contacts=(BRISTLE,), motions=("steps", "sines"), body=True
    ),
    "six-cascade-sines": replace(
        _ANTHROPOMORPHIC,
        joints=6,
        controller=CASCADE,
        rate=(350.0,),
        bits=(18,),
        contacts=(BRISTLE,),
        motions=("sines", "steps"),
    ),
}
"""Kinds that a registered trial used and that were then looked at (docs/how-well.md); now for tuning."""

REPORTING: dict[str, Kind] = {}
"""Kinds that only a registered trial uses. None may be looked at during tuning. All have been used."""

KINDS = TUNING | REPORTED | REPORTING

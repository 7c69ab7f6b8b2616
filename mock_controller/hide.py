"""`python -m mock_controller.hide`: prints a seed for `mock://?secret=SEED` whose arm hides one effect of a clear size.

`--effect` and `--joint` select it; `--list` prints the effects that can be hidden and their joints. The output is one
line of JSON: the seed, which reveals nothing by itself, and its seal. The seal is the SHA-256 of the line that `python
-m mock_controller.reveal SEED` prints, so nobody can change the secret afterwards. Exit code 2 for an unknown effect.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterable
from hashlib import sha256
from random import Random, SystemRandom

from mock_controller.hidden.arm import HiddenArm, Kind, Load, SecretError, compose_seed, draw_arm
from mock_controller.hidden.sizes import LATER_SIZES, OPEN_SIZES, SHARED_SIZES, SizeRange
from mock_controller.modifications.registry import is_shared

CLEAR = 0.5
"""Least strength: the upper half of the sizes that blind trials draw, on their logarithmic scale."""
_NUMBERS = 2**48
"""Number of possible seeds, so large that nobody finds a seed by its seal."""
KNOWN = {
    Kind.SINGLE: SHARED_SIZES,
    Kind.LATER_SINGLE: LATER_SIZES,
    Kind.OPEN_SET: tuple(size for size in OPEN_SIZES if is_shared(size.effect)),
}
"""Effects that those who diagnose know, by the kind of arm that hides them."""


def seed_that_hides(random: Random, effect: str | None = None, joint: int | None = None) -> int:
    """Returns a drawn seed whose arm hides only this effect on this joint, clearly. Raises SecretError if no arm
    does."""
    fitting = [(kind, size) for kind, sizes in KNOWN.items() for size in sizes if effect in (None, size.effect)]
    if not any(joint is None or joint in _joints(size) for _, size in fitting):
        on = "" if joint is None else f" on joint {joint}"
        raise SecretError(f"effect {effect or 'any'}{on}: cannot be hidden; --list says what can")
    kind = fitting[0][0]
    while True:
        arm = draw_arm(compose_seed(random.randrange(_NUMBERS), kind, Load.NOMINAL))
        if _fits(arm, effect, joint):
            return arm.seed


def _fits(arm: HiddenArm, effect: str | None, joint: int | None) -> bool:
    (hidden,) = arm.effects
    return hidden.strength >= CLEAR and effect in (None, hidden.name) and (joint is None or joint in hidden.joints)


def _joints(size: SizeRange) -> tuple[int, ...]:
    return size.joints if size.acts_on_joints else ()


def _choices(sizes: Iterable[SizeRange]) -> list[dict[str, object]]:
    return [{"effect": size.effect, "joints": list(_joints(size))} for size in sizes]


def main(arguments: list[str]) -> int:
    """Prints a seed and its seal; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m mock_controller.hide", description=__doc__)
    parser.add_argument("--effect", help="the effect to hide")
    parser.add_argument("--joint", type=int, help="the joint to hide it on")
    parser.add_argument("--list", action="store_true", help="the effects that can be hidden")
    given = parser.parse_args(arguments)
    if given.list:
        print(json.dumps(_choices(size for sizes in KNOWN.values() for size in sizes)))
        return 0
    try:
        seed = seed_that_hides(SystemRandom(), given.effect, given.joint)
    except SecretError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    print(json.dumps({"seed": seed, "seal": sha256(f"{json.dumps(draw_arm(seed).truth())}\n".encode()).hexdigest()}))
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))

"""Loads users' effects from files into the library, where they stay until they are removed.

Loading runs the file, so only a file that a person names is loaded. A saved model states the name and hash of the file
that it needs, but never makes a program run it.
"""

from __future__ import annotations

import hashlib
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

from daq.contracts.documents import read_text
from daq.contracts.errors import SpecError
from model.effects.effect import Effect, EffectFile
from model.effects.library import add_own, own_effects
from model.effects.own import OwnEffect, as_library_effect

HASH_DIGITS = 16
EFFECT = "EFFECT"


def load_effect_file(path: Path) -> Effect:
    """Returns the effect that a file defines as `EFFECT`, and adds it to the library; loading it twice changes nothing.

    Raises SpecError, in one line, for a file that cannot be read or run, or that defines no valid effect, and for an
    effect name that another loaded file uses.
    """
    source = read_text(path, f"effect file {path}").encode()
    if path.suffix != ".py":
        raise SpecError(f"effect file {path}: it is Python, so its name must end in .py")
    file = EffectFile(name=path.name, sha256=hashlib.sha256(source).hexdigest()[:HASH_DIGITS])
    for known in own_effects().values():
        if known.file == file:
            return known
    found = as_library_effect(_stated(path, file), file)
    add_own(found)
    return found


def _stated(path: Path, file: EffectFile) -> OwnEffect:
    """Runs the file under a module name of its own; returns the effect that it defines."""
    name = f"own_effect_{file.sha256}"
    spec = spec_from_file_location(name, path.resolve())
    if spec is None or spec.loader is None:
        raise SpecError(f"effect file {path}: cannot be loaded as Python")
    module = module_from_spec(spec)
    sys.modules[name] = module  # dataclasses and numba look up a function's module by its name
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        del sys.modules[name]
        raise SpecError(f"effect file {path}: running it raises {type(error).__name__}: {error}") from error
    stated = getattr(module, EFFECT, None)
    if not isinstance(stated, OwnEffect):
        raise SpecError(f"effect file {path}: defines no effect; write {EFFECT} = OwnEffect(…), see docs/own-effect.md")
    return stated

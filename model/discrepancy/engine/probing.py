"""Probes: how much of what is left every trial could explain, with the tolerance parameters free to follow.

An effect is tried at finite sizes, not differentiated where it is absent: backlash, a dead zone or a limit has no
useful derivative there. What it changes is compared with what is left, after what the tolerance parameters can explain
at the cost of their priors has been projected out of both.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from model.arrays import Floats
from model.discrepancy.engine.fitting import Fit
from model.discrepancy.engine.priors import prior_distance, prior_rows
from model.fitting.covariance import inverse
from model.machine_model.model import Model
from model.machine_model.parameter import Parameter

Start = dict[str, float]
"""Values by full name."""

LARGEST_STRETCH = 2.0
"""Largest factor by which a trial of an effect that is not linear in its size is scaled."""
SAME = 1e-7
"""Share of what a trial changes, by its square, below which the unknowns do the same."""
ONE_SIDED = "one_sided_spring"
"""The effect whose size changes its law with its sign."""


@dataclass(frozen=True)
class Trial:
    """An effect on joints, with its own parameters and the starting values from which it is tried.

    amplitudes: its parameters (full names) that measure its size; the others only shape it. shares: of the start's
    sizes, at which it is tried. linear: whether what it changes is all but in proportion to its size.
    stated: those of its parameters that the file states, as it states them: the trial lifts their priors. Its starts
    are then measured from where the tolerances' fit has them, `origin`, and not from nothing.
    places: how many of its kind the start was chosen from, as the rates of a tone. law: the effect of the model, where
    the name stands for two; empty where it is the same. phases: numbers that it adds to single records.
    """

    effect: str
    joints: tuple[int, ...]
    model: Model
    parameters: tuple[Parameter, ...]
    amplitudes: tuple[str, ...]
    starts: tuple[Start, ...]
    stated: tuple[Parameter, ...] = ()
    origin: Mapping[str, float] = field(default_factory=dict)
    shares: tuple[float, ...] = (1.0,)
    linear: bool = True
    places: int = 1
    law: str = ""
    phases: int = 0

    @property
    def size(self) -> int:
        """Numbers that the effect adds."""
        return len(self.parameters) + self.phases

    def among(self, places: int) -> Trial:
        """The same, chosen from so many."""
        return replace(self, places=places)

    @property
    def null(self) -> Start:
        """The sizes at which it does nothing, as far as bounds allow."""
        known = {p.name: float(np.clip(p.null, p.low, p.high)) for p in self.parameters if p.null is not None}
        return known | dict(self.origin)


@dataclass(frozen=True)
class Probe:
    """A trial at its best start: the fall of the cost that it promises, and the start, scaled to fit."""

    trial: Trial
    gain: float
    start: Start
    row: Floats | None = None
    """(N,) what its start changes."""


@dataclass(frozen=True)
class Projection:
    """A fit, prepared for probing: what its unknowns explain at the cost of their priors is projected out of signals.

    tangents: (p, N) weighted derivatives in scales of the unknowns. inverse: (p, p) of their information. left: (N,)
    weighted, what is left. pull: (p,) how much all of it asks of the unknowns.
    """

    now: Fit
    tangents: Floats
    inverse: Floats
    left: Floats
    pull: Floats

    def products(self, rows: Floats, columns: slice = slice(None)) -> tuple[Floats, Floats]:
        """Of weighted rows (k, N′), after projection: their products (k, k) with one another, and (k,) with what is
        left. The rows are zero outside `columns`."""
        shared = self.tangents[:, columns] @ rows.T
        explained = self.inverse @ shared
        return rows @ rows.T - shared.T @ explained, rows @ self.left[columns] - explained.T @ self.pull

    def pairs(self, one: Floats, other: Floats, columns: slice) -> tuple[Floats, Floats, Floats, Floats, Floats]:
        """The same of many pairs of rows (k, N′): products of each with itself and its partner, and with what is left,
        (k,) each."""
        shared = [self.tangents[:, columns] @ rows.T for rows in (one, other)]
        explained = [self.inverse @ s for s in shared]
        own, theirs = (
            np.einsum("kn,kn->k", r, r) - np.einsum("pk,pk->k", s, e)
            for r, s, e in zip((one, other), shared, explained, strict=True)
        )
        mixed = np.einsum("kn,kn->k", one, other) - np.einsum("pk,pk->k", shared[0], explained[1])
        by_one, by_other = (
            r @ self.left[columns] - e.T @ self.pull for r, e in zip((one, other), explained, strict=True)
        )
        return own, theirs, mixed, by_one, by_other

    def probe(self, trial: Trial) -> Probe:
        """The best of a trial's starts."""
        best = Probe(trial, 0.0, trial.starts[0])
        if trial.stated:
            best = Probe(trial, self._lift_priors(trial), dict(trial.origin))
        return max((best, *self.probes(trial)), key=lambda p: p.gain)

    def probes(self, trial: Trial) -> list[Probe]:
        """A trial from every start and share that stays finite, as large as explains most."""
        null, found = trial.null, []
        tried = [(start, share) for start in trial.starts for share in trial.shares]
        every = self.now.compared.of_model(trial.model).changes(
            {**self.now.values, **null},
            [
                {**self.now.values, **start, **null, name: null[name] + share * (start[name] - null[name])}
                for start, share in tried
                for name in trial.amplitudes
            ],
        )
        count = len(trial.amplitudes)
        for k, (start, share) in enumerate(tried):
            rows = every[k * count : (k + 1) * count]
            if not np.isfinite(rows).all():
                continue
            gain, sizes = self._explained(self.now.weighted(rows) / share, trial, start)
            sized = zip(trial.amplitudes, sizes, strict=True)
            scaled = {n: null[n] + float(a) * (start[n] - null[n]) for n, a in sized}
            found.append(Probe(trial, gain, {**start, **scaled}, sizes @ rows / share))
        return found

    def nearest(self, trial: Trial) -> Start:
        """Of a trial's starts, as large as probes promise, the one that leaves least in the simulation itself: what
        makes a joint stick and slip is not in proportion to its size."""
        starts = [p.start for p in self.probes(trial)] or [trial.starts[0]]
        wider, base = self.now.compared.of_model(trial.model), {**self.now.values, **trial.null}
        changes = wider.changes(base, [{**self.now.values, **start} for start in starts])
        left = self.left + self.now.weighted(np.nan_to_num(changes))
        squares, _ = self.products(left)
        return starts[int(np.argmin(np.where(np.isfinite(changes).all(axis=1), np.diag(squares), np.inf)))]

    def _lift_priors(self, trial: Trial) -> float:
        """What the trial gains by its priors alone, with its numbers where they are."""
        own = (u for u in self.now.unknowns if u.name in trial.origin)
        return sum(prior_distance(u, self.now.values[u.name])[0] ** 2 for u in own)

    def _explained(self, rows: Floats, trial: Trial, start: Start) -> tuple[float, Floats]:
        """Fall of the cost, and the amplitudes (as shares of the start's) that cause it, none of a wrong sign."""
        squares, products = self.products(rows)
        kept = np.diag(squares) > SAME * np.maximum(np.einsum("kn,kn->k", rows, rows), 1e-300)
        shares = np.zeros(len(rows))
        while kept.any():
            found = np.linalg.lstsq(squares[np.ix_(kept, kept)], -products[kept], rcond=1e-10)[0]
            shares[:] = 0.0
            shares[kept] = found if trial.linear else np.clip(found, 0.0, LARGEST_STRETCH)
            wrong = kept & np.array(
                [_is_outside(trial, n, a, start) for n, a in zip(trial.amplitudes, shares, strict=True)]
            )
            if not wrong.any():
                break
            kept &= ~wrong
            shares[:] = 0.0
        return float(-2 * shares @ products - shares @ squares @ shares), shares


def _is_outside(trial: Trial, name: str, share: float, start: Start) -> bool:
    if trial.effect == ONE_SIDED and share < 0.0:
        return True  # a cable on the other side begins to pull elsewhere: another start
    p, null = next(p for p in trial.parameters if p.name == name), trial.null
    value = null[name] + share * (start[name] - null[name])
    room = 1e-9 * max(1.0, abs(value))
    return not p.low - room <= value <= p.high + room


def rise_without(now: Fit, names: Collection[str]) -> float:
    """By how much the cost rises where parameters go to their null values and all other unknowns follow, as far as
    derivatives tell. `now` has derivatives."""
    nulls = {k: u.parameter.null for k, u in enumerate(now.unknowns) if u.name in names}
    own = {
        k: (null - now.values[now.unknowns[k].name]) / now.unknowns[k].scale
        for k, null in nulls.items()
        if null is not None
    }
    if not own:
        return 0.0
    numbers, back = list(own), np.array(list(own.values()))
    return float(back @ np.linalg.solve(projection(now).inverse[np.ix_(numbers, numbers)], back))


def projection(now: Fit) -> Projection:
    """The projection at a fit. `now` has derivatives."""
    scale = np.array([u.scale for u in now.unknowns])
    rows, aims = prior_rows(now.unknowns, np.array([now.values[u.name] for u in now.unknowns]))
    slopes, left = now.slopes(), now.weighted(now.row)
    tangents = np.zeros((0, len(left)))
    if now.unknowns:
        tangents = now.weighted(np.stack([slopes[u.name] for u in now.unknowns])) * scale[:, None]
    rows = rows * scale
    information = tangents @ tangents.T + rows.T @ rows
    information[np.diag_indices_from(information)] *= 1 + 1e-9
    return Projection(now, tangents, inverse(information), left, tangents @ left - rows.T @ aims)

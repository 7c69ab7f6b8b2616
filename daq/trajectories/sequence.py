"""Pieces one after the other, each from where the one before ended."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from daq.trajectories.piece import Piece, periods_in
from daq.trajectories.set_points import Mark


def join_pieces(pieces: Iterable[Piece], joints: int, period: float) -> Piece:
    """One piece from several on the same `joints` joints. Raises SpecError when it grows longer than LONGEST."""
    offsets = [np.zeros((0, joints))]
    jumps = [np.zeros(0, dtype=np.bool_)]
    marks: list[Mark] = []
    reached = np.zeros(joints)
    length = 0
    for piece in pieces:
        offsets.append(piece.offsets + reached)
        jumps.append(piece.jumps)
        marks.extend(replace(mark, index=mark.index + length) for mark in piece.marks)
        length += len(piece.offsets)
        periods_in(length * period, period)  # too long is refused before it fills the memory
        if len(piece.offsets):
            reached = offsets[-1][-1]
    return Piece(np.concatenate(offsets), np.concatenate(jumps), tuple(marks))


def spread(piece: Piece, columns: list[int], joints: int) -> Piece:
    """Extends a piece to `joints` joints: its own go to `columns`, the others stand still."""
    offsets = np.zeros((len(piece.offsets), joints))
    offsets[:, columns] = piece.offsets
    return replace(piece, offsets=offsets)

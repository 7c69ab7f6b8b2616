"""Short damage never passes for a frame: errors of one to three bits, and bursts of up to 16."""

from functools import reduce
from itertools import combinations
from operator import xor

import pytest

from firmware_protocol.framing import MAX_BODY, crc16

BITS = MAX_BODY * 8


@pytest.fixture(scope="module")
def syndromes() -> list[int]:
    """What each single wrong bit of the largest body does to the CRC taken over the whole body, first bit first.

    The CRC is linear: several wrong bits do the exclusive or of what each does, and are found unless that is 0.
    """
    right = crc16(bytes(MAX_BODY))
    return [crc16((1 << (BITS - 1 - bit)).to_bytes(MAX_BODY, "big")) ^ right for bit in range(BITS)]


def test_every_error_of_one_to_three_bits_is_found(syndromes: list[int]) -> None:
    single = set(syndromes)
    assert 0 not in single
    assert len(single) == BITS, "two wrong bits cancel"
    assert not any(one ^ other in single for one, other in combinations(syndromes, 2)), "three wrong bits cancel"


def test_every_burst_of_up_to_16_bits_is_found(syndromes: list[int]) -> None:
    """16 syndromes in a row are independent, at every place: no choice of them but the empty one gives 0."""
    for start in range(BITS - 15):
        assert rank(syndromes[start : start + 16]) == 16


def rank(vectors: list[int]) -> int:
    """Rank over the field of two elements."""
    basis: list[int] = []
    for vector in vectors:
        reduced = reduce(lambda value, row: min(value, value ^ row), basis, vector)
        if reduced:
            basis.append(reduced)
            basis.sort(reverse=True)
    return len(basis)


def test_syndromes_add_up(syndromes: list[int]) -> None:
    """Guards the two tests above: the CRC really is linear, through the real function."""
    wrong = (3, 17, 200, 431)
    body = sum(1 << (BITS - 1 - bit) for bit in wrong).to_bytes(MAX_BODY, "big")
    assert crc16(body) ^ crc16(bytes(MAX_BODY)) == reduce(xor, (syndromes[bit] for bit in wrong))

"""Damage that passes for a frame: at most 2^-16 of damaged frames; short damage never."""

from functools import reduce
from itertools import combinations
from operator import xor

import pytest

from benchmarks.undetected_damage import BOUND, DAMAGE, Rate, measure
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


def test_few_of_the_frames_with_worse_damage_pass() -> None:
    """A tenth of the campaign below: no way of damage is above the bound, and all of them are not far from it."""
    rates = _rates(25_000)
    assert sum(rates, Rate(0, 0)).damaged >= 200_000
    assert sum(rates, Rate(0, 0)).interval[1] <= 4 * BOUND


@pytest.mark.slow
def test_of_frames_damaged_worse_at_most_one_in_65536_passes() -> None:
    """Two million frames and more, damaged in every way: the whole interval of the rate lies below the bound."""
    total = sum(_rates(225_000), Rate(0, 0))
    assert total.damaged >= 2_000_000
    assert total.undetected > 0, "a campaign that finds nothing measures nothing"
    assert total.interval[1] <= BOUND


def _rates(frames: int) -> list[Rate]:
    """Of every way of damage, none of which is above the bound."""
    rates = {name: measure(damage, frames, seed=7) for name, damage in DAMAGE.items()}
    for name, rate in rates.items():
        assert rate.interval[0] <= BOUND, name
    return list(rates.values())

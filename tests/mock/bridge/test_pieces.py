"""However the operating system cuts the host's bytes, the pieces are the same."""

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from mock_controller.bridge.pieces import LONGEST, PieceSplitter

STREAMS = st.lists(st.sampled_from([b"\0", b"a", b"bc", b"\0\0", b"\x01" * 29]), max_size=20).map(b"".join)


@given(STREAMS, st.lists(st.integers(0, 600), max_size=8))
def test_pieces_do_not_depend_on_how_the_bytes_were_cut(stream: bytes, cuts: list[int]) -> None:
    splitter = PieceSplitter()
    edges = [0, *sorted(cuts), len(stream)]
    pieces = [piece for start, end in pairwise(edges) for piece in splitter.feed(stream[start:end])]
    assert pieces == PieceSplitter().feed(stream)


def test_a_frame_comes_with_both_its_delimiters() -> None:
    assert PieceSplitter().feed(b"\0ab\0\0cd\0") == [b"\0ab\0", b"\0cd\0"]


def test_delimiters_alone_are_no_piece() -> None:
    splitter = PieceSplitter()
    assert splitter.feed(b"\0" * 1000) == []
    assert splitter.feed(b"x\0") == [b"\0x\0"]


def test_what_is_too_long_is_passed_on_in_parts_and_ends_once() -> None:
    splitter = PieceSplitter()
    pieces = [piece for _ in range(100) for piece in splitter.feed(b"x" * 10)] + splitter.feed(b"\0")
    assert b"".join(pieces) == b"x" * 1000 + b"\0"
    assert max(map(len, pieces)) == LONGEST
    assert [piece.endswith(b"\0") for piece in pieces] == [False] * (len(pieces) - 1) + [True]


def test_a_new_connection_does_not_inherit_an_unfinished_piece() -> None:
    splitter = PieceSplitter()
    splitter.feed(b"\0unfinished")
    splitter.reset()
    assert splitter.feed(b"\0whole\0") == [b"\0whole\0"]

"""The mutation tool makes the faults it promises, and its list of equivalent mutants names faults that exist."""

from benchmarks.mutants import Mutant, mutants_of
from benchmarks.mutation import ROOT, chosen_tests, equivalents, mirrored_folder, reaching

SOURCE = b'''"""Text 1."""
LIMIT: float = 2.0

def within(x: int | None, low: int = 3) -> bool:
    """Text 2."""
    if x is None or not x:
        raise ValueError(f"{x - 1} of 5")
    self.seen += 1
    self.last = x
    log.info("seen", 7)
    return low <= -x < LIMIT
'''


def test_each_operator_number_condition_statement_and_answer_gets_a_fault_of_its_own() -> None:
    changes = {(mutant.line, mutant.was, mutant.now) for mutant in mutants_of(SOURCE, "a.py")}
    assert changes == {
        (2, "2.0", "4.0"),
        (4, "3", "4"),
        (6, "x is None or not x", "not (x is None or not x)"),
        (6, "x is None or not x", "x is None and (not x)"),
        (6, "x is None", "x is not None"),
        (6, "not x", "x"),
        (7, "raise ValueError(f'{x - 1} of 5')", "pass"),
        (8, "self.seen += 1", "pass"),
        (8, "self.seen += 1", "self.seen -= 1"),
        (8, "1", "2"),
        (9, "self.last = x", "pass"),
        (11, "low <= -x < LIMIT", "None"),
        (11, "low <= -x < LIMIT", "low < -x < LIMIT"),
        (11, "low <= -x < LIMIT", "low <= -x <= LIMIT"),
        (11, "-x", "x"),
    }


def test_a_mutant_differs_from_its_file_in_one_place() -> None:
    for mutant in mutants_of(SOURCE, "a.py"):
        changed = mutant.applied(SOURCE)
        compile(changed, "a.py", "exec")
        assert changed[: mutant.start] == SOURCE[: mutant.start]
        assert changed.endswith(SOURCE[mutant.end :])
        assert changed != SOURCE


def test_a_module_is_tried_by_the_tests_that_reach_it() -> None:
    assert mirrored_folder("daq/link/pending.py") == ROOT / "tests" / "daq" / "link"
    assert mirrored_folder("firmware_protocol/units.py") == ROOT / "tests" / "protocol"
    assert mirrored_folder("server/queue/order.py").is_relative_to(ROOT / "tests" / "server")
    assert "tests/daq/link/test_transactions.py" in reaching("daq/link/pending.py")
    assert "tests/protocol/test_memory_map.py" not in reaching("firmware_protocol/framing.py")


def test_tools_beside_the_sources_of_the_bridge_are_tried_by_the_tests_of_the_bridge() -> None:
    """They belong to no package, so that only a test that imports them, or the whole folder, can reach them."""
    assert mirrored_folder("firmware_protocol/bridge/stack.py") == ROOT / "tests" / "firmware"
    assert reaching("firmware_protocol/bridge/stack.py") == ("tests/firmware/test_sizes_and_stack.py",)
    assert "tests/firmware/bbc_micro/test_disc_image.py" in reaching("firmware_protocol/bridge/bbc_micro/disc_image.py")
    assert mirrored_folder("mock_controller/board/board.py").is_relative_to(ROOT / "tests" / "mock")


def test_tests_that_take_too_long_are_left_out_and_the_quickest_file_comes_first() -> None:
    seconds = {"a.py::x": 2.0, "a.py::y": 9.0, "b.py::x": 1.0, "c.py::x": 0.1}
    chosen = chosen_tests(("a.py", "b.py"), seconds, longest_s=5.0)
    assert (chosen.files, chosen.deselected, chosen.seconds) == (("b.py", "a.py"), ("a.py::y",), 3.0)


def test_every_equivalent_mutant_exists() -> None:
    listed = set(equivalents())
    made = {mutant.identity for file in {file for file, *_ in listed} for mutant in _mutants_of_file(file)}
    assert listed - made == set()


def _mutants_of_file(file: str) -> list[Mutant]:
    return mutants_of((ROOT / file).read_bytes(), file)

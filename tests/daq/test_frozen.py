"""What checks a record is built when it is used first, or at once where a process keeps time."""

import gc

from daq.contracts.frozen import FrozenRecord, build_records


def test_all_records_that_are_loaded_can_be_built_at_once() -> None:
    class Later(FrozenRecord):
        number: int

    assert not Later.__pydantic_complete__
    build_records()
    assert Later.__pydantic_complete__
    del Later
    gc.collect()

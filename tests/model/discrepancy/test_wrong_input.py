"""What a diagnosis refuses, in one line."""

import pytest

from daq.contracts.errors import TraceError
from model.discrepancy.workflow import diagnose
from tests.model.fitting import imagined


def test_a_trace_that_is_both_fitted_to_and_held_out_is_refused() -> None:
    record = imagined.trace(imagined.arm())
    with pytest.raises(TraceError, match="both fitted to and held out"):
        diagnose(imagined.arm(), [record], [record])

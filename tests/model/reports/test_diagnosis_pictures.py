"""What the figures of a diagnosis show, and in which order: without drawing them."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from model.comparison.compare import TraceSignals
from model.discrepancy.diagnosis import Candidate, PhaseCell, Where
from model.reports import diagnosis_map, diagnosis_pictures
from model.reports.diagnosis_map import by_shade, map_picture, shade_limits
from model.reports.diagnosis_pictures import evidence_picture, shown_candidates
from model.reports.figures import band
from model.reports.motion import _reach
from model.reports.motion_closer import stretch_of_most


def tried(effect: str, evidence: float, *, refitted: bool = True) -> Candidate:
    return Candidate(effect=effect, joints=(2,), evidence=evidence, refitted=refitted)


def cell(times: float, start: float = 0.0, joint: int = 1, window: float = 0.3) -> PhaseCell:
    return PhaseCell(
        joint=joint, start=start, end=start + window, phase="creep", mean_square=times**2, significance=0.0
    )


@pytest.fixture
def figure(monkeypatch: pytest.MonkeyPatch) -> Figure:
    """The figure that the next picture draws on, which is not written as SVG."""
    found = Figure()

    def drawn(draw, *_: float) -> str:  # type: ignore[no-untyped-def]
        draw(found)
        return "<svg></svg>"

    for module in (diagnosis_map, diagnosis_pictures):
        monkeypatch.setattr(module, "drawn", drawn)
    return found


def test_probes_stand_below_the_fits_and_are_few() -> None:
    probes = [tried(f"probe_{k}", 9000.0 - k, refitted=False) for k in range(20)]
    fitted, probed = shown_candidates([*probes, tried("coulomb_friction", 1714.0), tried("gear_loss", 143.0)])
    assert [c.effect for c in fitted] == ["coulomb_friction", "gear_loss"]
    assert [c.effect for c in probed] == ["probe_0", "probe_1", "probe_2", "probe_3"]


def test_the_named_one_is_always_shown() -> None:
    every = [tried(f"effect_{k}", 100.0 - k) for k in range(30)]
    fitted, _ = shown_candidates(every, {("effect_29", (2,))})
    assert [c.effect for c in fitted][-2:] == ["effect_9", "effect_29"]


def test_what_a_probe_promises_beyond_the_fits_is_cut_off_and_told(figure: Figure) -> None:
    named = tried("air_drag", 2064.0)
    evidence_picture([tried("stiction", 10070.0, refitted=False), named], [named])
    axes = figure.axes[0]
    assert max(patch.get_width() for patch in axes.patches) == 2064.0  # type: ignore[attr-defined]
    texts = [t.get_text() for t in axes.texts]
    assert "10070, beyond the scale" in texts
    assert "promised by probes alone, not fitted" in texts
    assert [t.get_text() for t in axes.get_yticklabels()] == ["air drag, joint 2", "stiction, joint 2"]


def test_the_line_that_an_effect_has_to_reach_is_drawn(figure: Figure) -> None:
    picture = evidence_picture([tried("coulomb_friction", 3.0)], needed=10.0)
    assert [t.get_text() for t in figure.axes[0].texts if "needed" in t.get_text()] == ["needed: 10"]
    assert figure.axes[0].get_xlim()[1] > 10.0
    assert "In full colour" not in picture.caption


def test_a_strong_map_keeps_its_structure() -> None:
    weak, strong = [cell(1.0), cell(3.0)], [cell(90.0), cell(350.0), cell(720.0)]
    assert shade_limits(weak) == (1.25, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)
    assert shade_limits(strong)[-1] == 1024.0
    assert [len(group) for group in by_shade(strong, shade_limits(strong))] == [0, 0, 0, 1, 0, 1, 1]


def test_the_map_reaches_over_all_joints_and_tells_its_windows(figure: Figure) -> None:
    cells = (cell(1.0, 0.5, 1, 0.5), cell(2.0, 6.0, 1, 0.5), cell(1.0, 2.0, 2, 0.5))
    where = Where(joint=1, phase="creep", summary="joint 1", cells=cells, dependences=())
    picture = map_picture(where, "measured − simulated")
    assert "windows of 0.5 s" in picture.caption
    assert all(axes.get_xlim() == (0.5, 6.5) for axes in figure.axes)
    assert "creep" in [t.get_text() for t in figure.axes[0].get_yticklabels()]


def test_many_samples_become_a_mean_and_a_shade() -> None:
    axes = Figure().subplots()
    time = np.linspace(0.0, 50.0, 5000)
    band(axes, time, np.where(np.arange(5000) % 2 == 0, 1.0, -1.0), "#0072b2")
    assert np.abs(axes.lines[0].get_ydata()).max() < 0.1
    assert axes.collections[0].get_datalim(axes.transData).height == pytest.approx(2.0)


def test_the_stretch_looked_at_closer_is_where_most_is_left() -> None:
    residual = np.zeros((1000, 2))
    residual[600:620, 1] = 1.0
    window, column = stretch_of_most(residual, 0.02)
    assert column == 1
    assert window.stop - window.start == 200
    assert window.start <= 600
    assert window.stop >= 620


def test_a_moment_does_not_hide_the_rest_of_a_residual() -> None:
    time = np.linspace(0.0, 50.0, 2500)
    measured = np.sin(40.0 * time)[:, None]
    zero = np.zeros_like(measured)
    usual = TraceSignals("a", None, (1,), ("rad",), time, measured, (zero,), None)
    reach, widest = _reach(usual)
    assert reach == widest
    measured = measured.copy()
    measured[0] = 50.0
    reach, widest = _reach(TraceSignals("a", None, (1,), ("rad",), time, measured, (zero,), None))
    assert widest == 50.0
    assert 2.0 < reach < 3.0

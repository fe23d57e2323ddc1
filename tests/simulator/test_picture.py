import pytest

from radioslam.simulator import SCENARIOS
from radioslam.simulator.picture import draw_survey


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_a_picture_is_drawn(scenario, tmp_path):
    pytest.importorskip("matplotlib")
    draw_survey(scenario, 1, tmp_path / "plan.png")
    assert (tmp_path / "plan.png").stat().st_size > 20_000

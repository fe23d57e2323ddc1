import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from radioslam.config import OdometryConfig
from radioslam.steps import LONGEST_INTERVAL_S, Steps, find_steps, step_lengths
from radioslam.walk import Inertial, Signal

from .phones import GRAVITY, STEP_HZ, bouncing, clock


def steps_of(norm):
    """Steps of an acceleration (n,) along the phone's z axis."""
    time_s = clock(len(norm) / 50.0)[: len(norm)]
    padded = np.append(norm, norm[-1:])  # the clock ends before the last sample
    values = np.column_stack([np.zeros((len(padded), 2)), padded])
    return find_steps(Inertial(Signal(np.append(time_s, time_s[-1:] + 0.02), values)), OdometryConfig())


def lengths_of(*walks, devices=None, **config):
    return step_lengths(walks, devices or [""] * len(walks), OdometryConfig(**config))


@pytest.mark.parametrize("duration_s", [20.0, 60.0])
def test_every_step_is_counted_once(duration_s):
    steps = steps_of(bouncing(clock(duration_s)))
    assert len(steps) == pytest.approx(STEP_HZ * duration_s, abs=1)
    np.testing.assert_allclose(np.diff(steps.time_s), 1 / STEP_HZ, atol=0.04)
    np.testing.assert_allclose(steps.interval_s[1:], np.diff(steps.time_s), atol=1e-9)


def test_a_phone_at_rest_makes_no_steps():
    assert len(steps_of(GRAVITY + np.random.default_rng(0).normal(0, 0.2, 3000))) == 0


def test_steps_stop_while_the_walker_stands():
    steps = steps_of(np.concatenate([bouncing(clock(20.0)), np.full(1000, GRAVITY), bouncing(clock(20.0))]))
    assert len(steps) == pytest.approx(2 * 20 * STEP_HZ, abs=3)
    assert not np.any((steps.time_s > 21.2) & (steps.time_s < 38.8))


def test_the_step_after_a_pause_has_the_usual_interval():
    steps = steps_of(np.concatenate([bouncing(clock(20.0)), np.full(1000, GRAVITY), bouncing(clock(20.0))]))
    assert np.diff(steps.time_s).max() > 10.0
    assert steps.interval_s.max() <= LONGEST_INTERVAL_S
    assert np.median(steps.interval_s) == pytest.approx(1 / STEP_HZ, abs=0.03)


def test_trembling_faster_than_steps_is_no_walking():
    steps = steps_of(GRAVITY + 2.0 * np.sin(2 * np.pi * 9.0 * clock(30.0)))
    assert len(steps) <= 1  # where the signal is cut off the filter may see one


@pytest.mark.parametrize("samples", [2, 99])
def test_a_signal_of_less_than_two_seconds_has_no_steps(samples):
    assert len(steps_of(np.full(samples, GRAVITY))) == 0


def test_a_constant_step_has_the_configured_length():
    steps = Steps(np.array([1.0, 2.0]), np.array([1.0, 3.0]), np.array([0.5, 0.5]))
    np.testing.assert_array_equal(lengths_of(steps, step_length="constant", typical_step_m=0.7)[0], [0.7, 0.7])


@pytest.mark.parametrize("bounce", [1.0, 4.0])
def test_weinbergs_step_is_the_fourth_root_of_the_bounce(bounce):
    lengths = lengths_of(steps_of(bouncing(clock(20.0), bounce)), step_length="weinberg", weinberg_constant=0.5)[0]
    inside = lengths[3:-3]
    np.testing.assert_allclose(inside, inside[0], rtol=0.02)
    assert inside[0] == pytest.approx(0.5 * (2 * bounce) ** 0.25, rel=0.05)  # the band pass takes some


def test_a_pendulums_step_grows_with_its_interval_and_the_root_of_its_bounce():
    steps = Steps(np.arange(4.0), np.array([4.0, 4.0, 4.0, 16.0]), np.array([0.5, 0.5, 0.6, 0.5]))
    lengths = lengths_of(steps, typical_step_m=0.6)[0]
    np.testing.assert_allclose(lengths / lengths[0], [1.0, 1.0, 1.2, 2.0])


def test_a_phone_models_median_step_is_typical_and_its_walks_keep_their_proportion():
    short = Steps(np.arange(10.0), np.full(10, 4.0), np.full(10, 0.5))
    long = Steps(np.arange(10.0), np.full(10, 9.0), np.full(10, 0.5))
    damped = Steps(np.arange(10.0), np.full(10, 1.0), np.full(10, 0.5))
    a, b, c = lengths_of(short, long, damped, devices=["x", "x", "y"], typical_step_m=0.6)
    assert np.median(np.concatenate([a, b])) == pytest.approx(0.6)
    assert b[0] / a[0] == pytest.approx(1.5)
    np.testing.assert_allclose(c, 0.6)


def test_the_pendulum_of_a_free_walk_gives_a_human_step():
    # 0.87 m of leg, 1.85 steps a second, 4.2 m/s² to either side: what a phone held firmly shows.
    interval_s, bounce = 1 / 1.85, 8.4
    assert interval_s / np.pi * np.sqrt(2 * 0.87 * bounce) == pytest.approx(0.66, abs=0.01)


@pytest.mark.parametrize("law", ["pendulum", "weinberg", "constant"])
def test_no_steps_have_no_lengths(law):
    nothing = Steps(np.zeros(0), np.zeros(0), np.zeros(0))
    assert [len(lengths) for lengths in lengths_of(nothing, nothing, step_length=law)] == [0, 0]


@given(st.lists(st.floats(0.5, 20.0), min_size=1, max_size=30), st.floats(0.3, 1.2))
def test_lengths_are_positive_and_scale_with_the_typical_step(bounce, typical):
    steps = Steps(np.arange(float(len(bounce))), np.array(bounce), np.full(len(bounce), 0.5))
    one, other = lengths_of(steps, typical_step_m=typical)[0], lengths_of(steps, typical_step_m=0.6)[0]
    assert np.all(one > 0)
    np.testing.assert_allclose(one / other, typical / 0.6)

import numpy as np
import pytest

from radioslam import rigid
from radioslam.config import load_config
from radioslam.point_cloud.registration import LITTLE_MATCHED, NO_MOTION, SLIDES, make_features, register
from tests.point_cloud.scenes import camera_at, random_motion, view

CONFIG = load_config(environment={}).registration
A, B = camera_at(2.0, 2.5, 0.2), camera_at(2.25, 2.4, 0.4)
TRUTH = rigid.inverse(A) @ B


@pytest.fixture(scope="module")
def pair():
    return make_features(view(A, 1), CONFIG), make_features(view(B, 2), CONFIG)


def test_two_views_register_without_a_guess(pair):
    found = register(*pair, CONFIG)
    metres, radians = rigid.apart(found.T_target_source, TRUTH)
    assert found.accepted
    assert metres < 0.03
    assert radians < 0.02


def test_the_frame_of_a_cloud_does_not_matter(pair):
    """The source turned about its sensor: the same motion, seen from the turned axes."""
    turn = random_motion(5, metres=0.0)
    turned = make_features(rigid.transform(turn, view(B, 2)), CONFIG)
    found = register(pair[0], turned, CONFIG)
    assert found.accepted
    assert rigid.apart(found.T_target_source @ turn, TRUTH)[0] < 0.03


def test_a_good_guess_is_taken_and_a_bad_one_does_no_harm(pair):
    for guess in (TRUTH @ rigid.motion(np.eye(3), np.array([0.03, 0.0, 0.02])), random_motion(9)):
        found = register(*pair, CONFIG, guess)
        assert found.accepted
        assert rigid.apart(found.T_target_source, TRUTH)[0] < 0.03


def test_what_lies_too_far_from_the_guess_is_not_believed(pair):
    off = TRUTH @ rigid.from_planar(np.array([[0.0, 0.0, 0.5]]))[0]
    assert register(*pair, CONFIG, off, reach=(10.0, 0.6)).accepted
    assert not register(*pair, CONFIG, off, reach=(10.0, 0.4)).accepted
    assert not register(*pair, CONFIG, random_motion(9), reach=(0.1, 4.0)).accepted


def test_back_and_forth_are_inverse(pair):
    there, back = register(*pair, CONFIG), register(pair[1], pair[0], CONFIG)
    metres, radians = rigid.apart(there.T_target_source @ back.T_target_source, np.eye(4))
    assert metres < 0.02
    assert radians < 0.01


def test_views_of_different_sides_are_not_accepted(pair):
    away = make_features(view(camera_at(2.0, 2.5, 0.2 + np.pi), 3), CONFIG)
    assert register(pair[0], away, CONFIG).reason in (NO_MOTION, LITTLE_MATCHED)


def test_more_points_are_asked_for_when_told_so(pair):
    strict = load_config(overrides=["registration.least_matched=0.99"], environment={}).registration
    assert not register(*pair, strict).accepted


def bent_wall(seed):
    """A wall and a floor, rough, with nothing that stops them from sliding along their edge."""
    rng = np.random.default_rng(seed)
    along, across = rng.uniform(-3, 3, (2, 6000)), rng.uniform(0, 2, 6000)
    wall = np.column_stack([along[0], across - 1.5, np.full(6000, 2.0)])
    floor = np.column_stack([along[1], np.full(6000, -1.5), 2.0 - across])
    return np.concatenate([wall, floor]) + rng.normal(0, 0.004, (12000, 3))


def test_a_wall_and_a_floor_slide_and_say_in_which_direction():
    first, second = (make_features(bent_wall(seed), CONFIG) for seed in (1, 2))
    found = register(first, second, CONFIG, np.eye(4))
    assert found.reason == SLIDES
    sigma = np.sqrt(np.diag(found.covariance)[3:])
    assert sigma[0] > 5 * max(sigma[1], sigma[2])


def test_what_slides_may_be_asked_not_to(pair):
    """With a limit that nothing can meet everything slides; with none nothing does by this test."""
    hard, soft = (
        load_config(overrides=[f"registration.least_loss={loss}"], environment={}).registration for loss in (0.99, 0.01)
    )
    assert register(*pair, hard, TRUTH).reason == SLIDES
    assert register(*pair, soft, TRUTH).accepted


def test_the_covariance_is_that_of_repeated_measurements(pair):
    """Views with other noise scatter within the covariance that each of them states, systematic part left out."""
    quiet = load_config(
        overrides=[
            "registration.systematic_sigma_m=0",
            "registration.systematic_sigma_rad=0",
            "registration.effective_points=1e9",
        ],
        environment={},
    ).registration
    runs = [
        register(make_features(view(A, s), quiet), make_features(view(B, s + 50), quiet), quiet, TRUTH)
        for s in range(12)
    ]
    spread = np.std([run.T_target_source[:3, 3] for run in runs], axis=0)
    stated = np.sqrt(np.mean([np.diag(run.covariance)[3:] for run in runs], axis=0))
    assert np.all(spread < 10 * stated)
    assert np.all(stated < 0.01)


def test_an_empty_cloud_registers_with_nothing(pair):
    empty = make_features(np.zeros((0, 3)), CONFIG)
    assert register(empty, pair[0], CONFIG).reason == NO_MOTION
    assert register(pair[0], empty, CONFIG, np.eye(4)).reason == NO_MOTION


@pytest.mark.real_data
def test_real_neighbours_register_and_strangers_do_not(data_folder):
    from radioslam.point_cloud import find_recordings
    from radioslam.point_cloud.clouds import read_cloud

    (recording,) = find_recordings([data_folder / "depth-frames"])
    chosen = [0, 1, 2, 30]
    features = [make_features(read_cloud(recording.clouds[k]), CONFIG) for k in chosen]
    T = recording.T_odom_body[chosen]
    for a, b in ((0, 1), (1, 2), (0, 2)):
        found = register(features[a], features[b], CONFIG)
        metres, radians = rigid.apart(found.T_target_source, rigid.inverse(T[a]) @ T[b])
        assert found.accepted
        assert metres < 0.05
        assert radians < np.deg2rad(3)
    assert not register(features[0], features[3], CONFIG).accepted

import numpy as np
import pytest

from radioslam import planar
from radioslam.config import FingerprintConfig, MergingConfig, OdometryConfig
from radioslam.errors import MappingError
from radioslam.fingerprints import collect_fingerprints
from radioslam.merging import merge_tracks
from radioslam.odometry import estimate_odometry
from radioslam.rigid_walks import Placement
from radioslam.uncertainty import UncertaintyModel
from radioslam.walk import Reference

from .builders import scans_of, tracked_walk

NORTHEAST = np.column_stack([np.arange(5.0), np.arange(5.0), np.full(5, 0.5)])
SCANS = scans_of((1, "a", -50), (1, "b", -50), (3, "a", -60))
OTHER_SCANS = scans_of((2, "a", -50), (3, "b", -60))
MODEL = UncertaintyModel(np.array([0.0, 1.0]), np.array([9.0, 1.0]), np.array([1, 1]))


def merge(*walks, **config):
    tracks = estimate_odometry(walks, OdometryConfig())
    fingerprints = collect_fingerprints(tracks, FingerprintConfig(rss_threshold_dbm=-127))
    return merge_tracks(tracks, fingerprints, fingerprints.rss_dbm, MODEL, MergingConfig(**config))


def fix(time_s, x, y):
    return Reference(np.array([time_s]), np.array([[x, y]], dtype=float))


def turned(walk_poses, angle):
    return planar.compose([0.0, 0.0, angle], walk_poses)


# Common start


def test_walks_with_a_common_start_have_their_first_scans_at_the_origin():
    merged = merge(tracked_walk(NORTHEAST, scans=SCANS), tracked_walk(NORTHEAST, scans=OTHER_SCANS), starts="common")
    np.testing.assert_array_equal(merged.walk, [0, 0, 1, 1])
    np.testing.assert_allclose(merged.poses[:, :2], [[0, 0], [2, 2], [0, 0], [1, 1]])
    np.testing.assert_array_equal(merged.frame, [0, 0])


def test_headings_stay_those_of_the_compass():
    merged = merge(tracked_walk(NORTHEAST), tracked_walk(turned(NORTHEAST, 1.0)), starts="common")
    np.testing.assert_allclose(merged.poses[:, 2], [0.5] * 5 + [1.5] * 5)


def test_first_nodes_are_linked_at_one_place_by_the_difference_of_their_headings():
    walks = [tracked_walk(turned(NORTHEAST, angle)) for angle in (0.0, 0.7, 3.0)]
    links = merge(*walks, starts="common").links
    np.testing.assert_array_equal(links.i, [0, 0])
    np.testing.assert_array_equal(links.j, [5, 10])
    np.testing.assert_allclose(links.measurement, [[0, 0, 0.7], [0, 0, 3.0]], atol=1e-12)


def test_a_link_over_the_seam_of_the_circle_turns_the_short_way():
    walks = [tracked_walk(turned(NORTHEAST, angle - 0.5)) for angle in (3.0, -3.0)]
    assert merge(*walks, starts="common").links.measurement[0, 2] == pytest.approx(2 * np.pi - 6)


def test_a_link_has_the_variance_of_its_scans_similarity_and_the_configured_one_of_heading():
    walks = tracked_walk(NORTHEAST, scans=SCANS), tracked_walk(NORTHEAST, scans=OTHER_SCANS)
    links = merge(*walks, starts="common", heading_variance=1000.0).links
    variance = 9.0 - 8.0 / np.sqrt(2)  # the first scans share one of two equally strong access points
    np.testing.assert_allclose(links.information[0], np.diag([1 / variance, 1 / variance, 1e-3]))


def test_a_common_start_is_anchored_once():
    merged = merge(tracked_walk(NORTHEAST), tracked_walk(NORTHEAST), starts="common")
    np.testing.assert_array_equal(merged.priors.node, [0])
    np.testing.assert_allclose(merged.priors.measurement, [[0, 0, 0.5]])


def test_a_single_walk_with_a_common_start_has_no_links():
    merged = merge(tracked_walk(NORTHEAST), starts="common")
    assert len(merged.links) == 0
    assert len(merged.priors) == 1


# Known starts


def test_a_walk_with_a_known_start_begins_there():
    merged = merge(tracked_walk(NORTHEAST, scans=SCANS, reference=fix(0.0, 100, 50)), starts="known")
    np.testing.assert_allclose(merged.poses, [[100, 50, 0.5], [101, 51, 0.5], [103, 53, 0.5]])
    np.testing.assert_array_equal(merged.fingerprint, [-1, 0, 1])


def test_the_node_of_a_start_stands_at_its_time_among_the_scans():
    merged = merge(tracked_walk(NORTHEAST, scans=SCANS, reference=fix(2.0, 0, 0)), starts="known")
    np.testing.assert_array_equal(merged.time_s, [1, 2, 3])
    np.testing.assert_array_equal(merged.fingerprint, [0, -1, 1])
    np.testing.assert_allclose(merged.poses[:, :2], [[-1, -1], [0, 0], [1, 1]])


def test_a_start_at_the_very_time_of_a_scan_is_a_node_beside_it():
    merged = merge(tracked_walk(NORTHEAST, scans=SCANS, reference=fix(1.0, 7, 7)), starts="known")
    np.testing.assert_array_equal(merged.time_s, [1, 1, 3])
    np.testing.assert_allclose(merged.poses[:2, :2], [[7, 7], [7, 7]])


def test_a_start_before_the_motion_holds_the_first_pose():
    merged = merge(tracked_walk(NORTHEAST, scans=SCANS, reference=fix(-5.0, 7, 8)), starts="known")
    np.testing.assert_allclose(merged.poses[:2, :2], [[7, 8], [8, 9]])


def test_only_the_first_reference_position_is_used():
    reference = Reference(np.array([0.0, 4.0]), np.array([[0.0, 0.0], [99.0, 99.0]]))
    merged = merge(tracked_walk(NORTHEAST, scans=SCANS, reference=reference), starts="known")
    np.testing.assert_allclose(merged.poses[-1, :2], [3, 3])
    assert len(merged.priors) == 1


def test_the_prior_of_a_known_start_has_the_configured_spread():
    walk = tracked_walk(NORTHEAST, reference=fix(0.0, 1, 2))
    priors = merge(walk, starts="known", start_sigma_m=2.0, heading_sigma_rad=0.5).priors
    np.testing.assert_allclose(priors.measurement, [[1, 2, 0.5]])
    np.testing.assert_allclose(priors.information, [np.diag([0.25, 0.25, 4.0])])


def test_walks_with_known_starts_share_a_frame():
    walks = [tracked_walk(NORTHEAST, reference=fix(0.0, x, 0)) for x in (0, 10)]
    merged = merge(*walks, starts="known")
    np.testing.assert_array_equal(merged.frame, [0, 0])
    assert len(merged.links) == 0


def test_a_walk_without_a_reference_gets_a_frame_and_an_anchor_of_its_own():
    lost, known = tracked_walk(NORTHEAST, scans=SCANS), tracked_walk(NORTHEAST, reference=fix(0.0, 9, 9))
    merged = merge(lost, known, lost, starts="known")
    assert len(set(merged.frame.tolist())) == 3
    assert merged.frame[1] == 0
    anchored = merged.walk[merged.priors.node]
    assert sorted(anchored.tolist()) == [0, 1, 2]
    stiffness = merged.priors.information[:, 0, 0]
    assert np.all(stiffness[anchored != 1] > 1000 * stiffness[anchored == 1])


def test_each_fingerprint_finds_its_node():
    walks = [tracked_walk(NORTHEAST, scans=SCANS, reference=fix(t, 0, 0)) for t in (0.0, 2.0, 3.0)]
    merged = merge(*walks, tracked_walk(NORTHEAST, scans=OTHER_SCANS), starts="known")
    np.testing.assert_array_equal(merged.fingerprint[merged.node_of_fingerprint], np.arange(8))
    assert np.all(np.diff(merged.walk) >= 0)
    assert all(np.all(np.diff(merged.time_s[merged.walk == k]) >= 0) for k in range(4))


def test_known_starts_without_any_reference_are_an_error():
    with pytest.raises(MappingError, match="found none; use --starts common"):
        merge(tracked_walk(NORTHEAST), starts="known")


# Starts that were found


def placed(walks, part, fixed, place=None, centre=None, **config):
    zeros = np.zeros((len(walks), 4))
    placement = Placement(
        centre=zeros[:, :2] if centre is None else np.asarray(centre, dtype=float),
        place=zeros if place is None else np.asarray(place, dtype=float),
        part=np.asarray(part),
        sigma_m=np.ones(len(walks)),
        reason=("",) * len(walks),
        fixed=np.asarray(fixed),
    )
    tracks = estimate_odometry(walks, OdometryConfig())
    fingerprints = collect_fingerprints(tracks, FingerprintConfig(rss_threshold_dbm=-127))
    return merge_tracks(tracks, fingerprints, fingerprints.rss_dbm, MODEL, MergingConfig(**config), placement)


def test_walks_are_laid_where_their_placement_says():
    place, centre = [[10, 20, np.pi / 2, np.log(2.0)]], [[1, 1]]
    merged = placed([tracked_walk(NORTHEAST, scans=SCANS)], [0], [False], place, centre, starts="unknown")
    np.testing.assert_allclose(merged.poses[:, :2], [[10, 20], [6, 24]], atol=1e-12)
    np.testing.assert_allclose(merged.poses[:, 2], 0.5 + np.pi / 2)


def test_found_places_are_held_weakly_at_the_middle_of_each_walk():
    walks = [tracked_walk(NORTHEAST), tracked_walk(NORTHEAST)]
    priors = placed(walks, [0, 0], [False] * 2, centre=[[2, 2], [2, 2]], starts="unknown", placed_sigma_m=4.0).priors
    np.testing.assert_array_equal(priors.node, [2, 7])
    np.testing.assert_allclose(priors.information[:, 0, 0], 1 / 16)


def test_walks_of_one_part_share_a_frame_and_a_walk_alone_is_anchored():
    merged = placed([tracked_walk(NORTHEAST)] * 3, [0, 0, 5], [False] * 3, starts="unknown")
    np.testing.assert_array_equal(merged.frame, [0, 0, 5])
    assert merged.priors.information[2, 0, 0] > 1000 * merged.priors.information[0, 0, 0]


def test_known_positions_among_found_ones_are_held_where_they_are():
    walks = [tracked_walk(NORTHEAST, scans=SCANS, reference=fix(2.0, 7, 8)), tracked_walk(NORTHEAST)]
    merged = placed(walks, [0, 0], [True, False], starts="mixed", start_sigma_m=0.5)
    np.testing.assert_array_equal(merged.fingerprint[:3], [0, -1, 1])
    np.testing.assert_array_equal(merged.priors.node[0], 1)
    np.testing.assert_allclose(merged.priors.measurement[0, :2], [7, 8])
    np.testing.assert_allclose(merged.priors.information[0, 0, 0], 4.0)


# Estimates


def test_poses_can_be_replaced_by_the_beginning_of_a_solution():
    merged = merge(tracked_walk(NORTHEAST, scans=SCANS), starts="common")
    moved = merged.at(np.arange(8.0))
    np.testing.assert_array_equal(moved.poses, [[0, 1, 2], [3, 4, 5]])
    assert moved.walk is merged.walk


def test_names_are_those_of_the_walks():
    assert merge(tracked_walk(NORTHEAST, name="x"), tracked_walk(NORTHEAST, name="y")).names == ("x", "y")

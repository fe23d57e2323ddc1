from dataclasses import replace

import numpy as np

from radioslam import rigid
from radioslam.config import load_config
from radioslam.point_cloud.nodes import beside, collect_nodes, walked_m
from tests.point_cloud.test_reference import circle, record

CONFIG = load_config(environment={})


def test_a_submap_takes_about_one_cloud_per_half_its_reach():
    walked = np.arange(0.0, 4.0, 0.1)
    found = beside(walked, 20, 1.0)
    assert 20 not in found
    assert np.abs(walked[found] - 2.0).max() <= 1.0
    assert set(np.rint((walked[found] - 2.0) / 0.5)) == {-2.0, -1.0, 1.0, 2.0} or len(found) in (4, 6)
    assert len(beside(walked, 20, 0.0)) == 0


def test_who_stands_still_adds_nothing_to_a_submap():
    assert len(beside(np.full(50, 3.0), 10, 1.0)) == 0


def test_walked_is_the_length_of_the_path():
    T = rigid.from_planar(np.array([[0.0, 0, 0], [3.0, 4.0, 1.0], [3.0, 4.0, 2.0]]))
    np.testing.assert_allclose(walked_m(T), [0.0, 5.0, 5.0])


def test_submaps_lie_where_their_own_cloud_lies_and_see_more(tmp_path):
    recording = record(tmp_path, circle()[:6])
    truth = rigid.from_planar(circle()[:6])
    recording = replace(recording, T_odom_body=truth)
    alone, joined = (
        collect_nodes(
            [recording],
            CONFIG.registration.model_copy(update={"key_points": 0}),
            CONFIG.reference.model_copy(update={"submap_m": submap_m}),
            1.0,
            lambda *_: None,
        )
        for submap_m in (0.0, 1.0)
    )
    assert len(alone) == len(joined) == 6
    for k in range(6):
        few, many = alone.features[k].surface, joined.features[k].surface
        assert len(many) > 1.3 * len(few)
        T = truth[k] @ recording.T_body_sensor
        points = rigid.transform(T, many.points)
        assert points[:, :2].min() > -0.15
        assert (points[:, :2].max(axis=0) < [6.15, 5.15]).all()
        assert len(many.points) > len(joined.features[k].key_points) == 0

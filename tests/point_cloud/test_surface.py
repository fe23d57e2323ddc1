import gc

import numpy as np
import pytest

from radioslam.point_cloud import surface as page
from radioslam.point_cloud.surface import make_surface, nearest
from tests.point_cloud.scenes import camera_at, view


def some_surface(seed=0):
    return make_surface(view(camera_at(2.0, 2.5, 0.3), seed), 0.1, 20)


def test_what_was_prepared_goes_with_its_surface():
    gc.collect()
    before = len(page._kept)
    surface = some_surface()
    nearest(surface, surface.points)
    assert len(page._kept) == before + 1
    del surface
    gc.collect()
    assert len(page._kept) == before


def test_only_the_last_used_are_kept(monkeypatch):
    monkeypatch.setattr(page, "PREPARED", 2)
    monkeypatch.setattr(page, "_kept", type(page._kept)())
    prepared, build = [], page._prepare
    monkeypatch.setattr(page, "_prepare", lambda surface: (prepared.append(surface), build(surface))[1])
    first, second, third = surfaces = [some_surface(seed) for seed in range(3)]
    for surface in (first, second, first, third, first, second):
        nearest(surface, surface.points[:5])
    assert [next(k for k, one in enumerate(surfaces) if one is p) for p in prepared] == [0, 1, 2, 1]


def test_the_nearest_point_of_a_point_is_itself():
    surface = some_surface()
    index, distance = nearest(surface, surface.points)
    np.testing.assert_array_equal(index, np.arange(len(surface)))
    assert distance == pytest.approx(0.0)

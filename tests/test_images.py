"""Images are written at their size, or say what is missing."""

from __future__ import annotations

import builtins
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from radioslam.errors import ResultError
from radioslam.images import save_error_cdf_png, save_map_png, save_paths_png, save_uncertainty_png
from tests.crowds import office_result


def png_size(path: Path) -> tuple[int, int]:
    data = path.read_bytes()
    assert data.startswith(b"\x89PNG")
    width, height = struct.unpack(">II", data[16:24])
    return width, height


@pytest.mark.parametrize("save", [save_paths_png, save_map_png])
def test_plans_are_1440_pixels_wide(save: Any, tmp_path: Path) -> None:
    save(office_result(), tmp_path / "plan.png")
    assert png_size(tmp_path / "plan.png")[0] == 1440


def test_curves_are_720_by_480_pixels(tmp_path: Path) -> None:
    model = office_result().uncertainty
    save_uncertainty_png({"office": model, "again": model}, tmp_path / "a.png")
    save_error_cdf_png({"odometry": np.array([1.0, np.nan, 3.0]), "estimate": np.arange(3.0)}, tmp_path / "b.png")
    assert png_size(tmp_path / "a.png") == png_size(tmp_path / "b.png") == (720, 480)


def test_missing_matplotlib_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    original = builtins.__import__

    def without_matplotlib(name: str, *args: Any, **kwargs: Any) -> Any:
        if name.startswith("matplotlib"):
            raise ModuleNotFoundError(name)
        return original(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", without_matplotlib)
    result = office_result()
    for save, what in (
        (save_paths_png, result),
        (save_map_png, result),
        (save_uncertainty_png, {"office": result.uncertainty}),
        (save_error_cdf_png, {"estimate": np.arange(3.0)}),
    ):
        with pytest.raises(ResultError, match=r"^[^\n]*pip install 'radioslam\[figures\]'$"):
            save(what, tmp_path / "never.png")  # type: ignore[operator]
    assert not list(tmp_path.iterdir())

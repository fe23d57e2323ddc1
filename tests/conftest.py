"""What tests share: where the real recordings are."""

import os
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def data_folder() -> Path:
    """The folder of real recordings; tests that ask for it are marked ``real_data``."""
    named = os.environ.get("RADIOSLAM_DATA")
    folder = Path(named) if named else REPOSITORY.parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip(f"no real recordings in {folder}; set RADIOSLAM_DATA to their folder")
    return folder

"""What whoever runs the service decides."""

from __future__ import annotations

from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field

LOOPBACK = ("127.0.0.1", "::1", "localhost")
MIB = 1024 * 1024


class Limits(BaseModel):
    """How much a client may ask for; beyond, it is told so with 413 or 429."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)

    body_bytes: int = Field(4 * MIB, gt=0)
    """Of a JSON request."""
    upload_bytes: int = Field(256 * MIB, gt=0)
    """Of an uploaded file, packed as it comes."""
    unpacked_bytes: int = Field(1024 * MIB, gt=0)
    """Of all files of an upload together, unpacked."""
    unpacking_ratio: float = Field(200.0, gt=1)
    """Unpacked over packed bytes of one file; logs of text reach about 20."""
    archive_files: int = Field(2000, gt=0)
    """Files in a zip."""
    walk_bytes: int = Field(64 * MIB, gt=0)
    """Of one walk as it is stored."""
    batches_per_s: float = Field(200.0, gt=0)
    """Of one API key, on average; a burst may be twice that."""
    request_s: float = Field(60.0, gt=0)
    """For the whole body of a request to arrive."""
    sessions: int = Field(10_000, gt=0)
    """Tracked sessions at a time; the one silent for longest gives way."""


class Settings(BaseModel):
    """The service's settings."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)

    data: Path = Path("radioslam-data")
    """Folder of the embedded database, the maps and the secret of hashed addresses."""
    database: str | None = None
    """SQLAlchemy URL; default: SQLite in ``data``."""
    open: bool = False
    """Everything is allowed without a key; only on loopback."""
    hash_bssids: bool = False
    """Store keyed hashes instead of access points' addresses."""
    map_every_s: float = Field(60.0, gt=0)
    """Pause between two maps of a site that changed."""
    keep_maps: int = Field(100, gt=1)
    """Versions kept of each site."""
    worker: bool = True
    """Whether this process starts the one that makes maps."""
    limits: Limits = Limits()

    @property
    def database_url(self) -> str:
        """URL of the database; a bare ``postgresql:`` takes the driver that the extra installs."""
        url = self.database or f"sqlite:///{self.data.absolute() / 'radioslam.sqlite'}"
        scheme, _, rest = url.partition("://")
        return f"postgresql+psycopg://{rest}" if scheme in ("postgres", "postgresql") else url

    @property
    def maps(self) -> Path:
        """Folder of the maps."""
        return self.data / "maps"

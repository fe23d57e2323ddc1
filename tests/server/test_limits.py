"""Bodies, walks, archives and rates end where the settings say, and each says so."""

from __future__ import annotations

import gzip
import io
import zipfile

import pytest

from radioslam.server.limits import BodyLimit
from radioslam.server.settings import Limits, Settings
from tests.server.service import Service
from tests.server.test_walks import upload

LIMITS = Limits(
    body_bytes=2000,
    upload_bytes=200_000,
    unpacked_bytes=3_000_000,
    unpacking_ratio=50,
    archive_files=5,
    walk_bytes=300,
    batches_per_s=20,
    request_s=0.2,
)


@pytest.fixture
def small(tmp_path):
    with Service(Settings(data=tmp_path, worker=False, limits=LIMITS)) as service:
        service.make_site()
        yield service


def test_long_bodies(small):
    long = {"id": "a", "title": "x" * 3000}
    assert "at most 2000 bytes" in small.post("/sites", long, expect=413).json()["error"]["message"]
    chunks = (b"x" * 500 for _ in range(10))
    small.ask("POST", "/sites", content=chunks, expect=413)
    upload(small, "a.txt", b"x" * 200_001, expect=413)


def test_long_walks(small):
    small.post("/sites/office/walks", {"name": "a"}, expect=201)
    statuses = []
    for sequence in range(12):
        pose = {"time_s": sequence / 7, "x_m": 1 / 3, "y_m": 2 / 3, "heading_rad": 0.1}
        batch = {"sequence": sequence, "poses": [pose]}
        statuses.append(small.post("/sites/office/walks/a/batches", batch).status_code)
    assert statuses[0] == 200
    assert statuses[-1] == 413
    assert small.get("/sites/office/walks/a")["size_bytes"] <= LIMITS.walk_bytes


def test_many_batches(small):
    small.post("/sites/office/walks", {"name": "a"}, expect=201)
    answers = [small.post("/sites/office/walks/a/batches", {"sequence": 0}) for _ in range(80)]
    refused = [answer for answer in answers if answer.status_code == 429]
    assert refused
    assert refused[0].headers["retry-after"] == "1"


def packed(**files):
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return content.getvalue()


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("bomb.zip", packed(a=b"0" * 2_000_000)),
        ("many.zip", packed(**{f"f{k}": b"x" for k in range(6)})),
        ("bomb.txt.gz", gzip.compress(b"0" * 2_000_000)),
        ("in.zip", packed(**{"b.gz": gzip.compress(b"0" * 2_000_000)})),
        ("big.zip", packed(**{f"f{k}": bytes(range(256)) * 3900 for k in range(4)})),
    ],
    ids=["zip", "many", "gzip", "gzip in zip", "sum"],
)
def test_bombs(small, name, content):
    assert "expected" in upload(small, name, content, expect=413).json()["error"]["message"]


def test_paths_of_a_zip_stay_inside(small, tmp_path):
    upload(small, "a.zip", packed(**{"../../../../outside.txt": b"x", "/tmp/outside-2.txt": b"y"}), expect=422)
    assert not list(tmp_path.rglob("outside*"))


@pytest.mark.anyio
async def test_bodies_that_do_not_arrive():
    import asyncio

    async def app(scope, receive, send):
        await receive()

    async def receive():
        await asyncio.sleep(30)

    sent = []

    async def send(message):
        sent.append(message)

    scope = {"type": "http", "path": "/sites", "headers": [], "method": "POST"}
    await BodyLimit(app, LIMITS)(scope, receive, send)
    assert sent[0]["status"] == 503


@pytest.fixture
def anyio_backend():
    return "asyncio"

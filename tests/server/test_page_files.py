"""The page's files: no data, no key, strict headers."""

from __future__ import annotations

import gzip

import pytest

from radioslam.server.settings import Settings
from tests.server.service import Service


@pytest.fixture
def one(tmp_path):
    with Service(Settings(data=tmp_path, worker=False)) as one:
        yield one


def test_the_root_leads_to_the_page(one):
    answer = one.client.get("/")
    assert answer.url.path == "/page/"
    assert answer.headers["content-type"].startswith("text/html")


@pytest.mark.parametrize("path", ["", "main.js", "style.css"])
def test_nothing_but_the_service_itself_is_allowed(one, path):
    answer = one.client.get(f"/page/{path}")
    policy = dict(part.split(" ", 1) for part in answer.headers["content-security-policy"].split("; "))
    assert policy["default-src"] == "'none'"
    assert policy["script-src"] == policy["style-src"] == policy["connect-src"] == "'self'"
    assert answer.headers["x-content-type-options"] == "nosniff"
    again = one.client.get(f"/page/{path}", headers={"If-None-Match": answer.headers["etag"]})
    assert again.status_code == 304


def test_plotly_comes_from_its_package_packed_once(one):
    from plotly.offline import get_plotlyjs

    for accepted in ("gzip", "identity"):
        with one.client.stream("GET", "/page/plotly.min.js", headers={"Accept-Encoding": accepted}) as answer:
            content = b"".join(answer.iter_raw())
        assert ("content-encoding" in answer.headers) == (accepted == "gzip")
        assert (gzip.decompress(content) if accepted == "gzip" else content) == get_plotlyjs().encode()


@pytest.mark.parametrize("path", ["nothing.js", "../page_files.py", "%2e%2e/page_files.py", "%00"])
def test_what_is_not_there_is_not_found(one, path):
    answer = one.client.get(f"/page/{path}")
    assert answer.status_code == 404
    assert answer.json()["error"]["status"] == 404


def test_a_key_is_told_whose_it_is(one):
    for role in ("upload", "read", "admin"):
        assert one.get("/key", role=role) == {"name": role, "role": role}

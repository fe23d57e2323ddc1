"""Keys and roles: nothing is readable or writable without one, and each role reaches so far and no farther."""

from __future__ import annotations

import pytest

from radioslam.errors import ConfigError
from radioslam.server.door_problems import PATHS
from radioslam.server.keys import add_key, list_keys, remove_key
from radioslam.server.serving import serve
from radioslam.server.settings import Settings
from radioslam.server.tables import Key
from tests.server.service import Service

PUBLIC = {"/health"}
ADMIN_ONLY = {
    ("POST", "/sites"),
    ("DELETE", "/sites/{site_id}"),
    ("PUT", "/sites/{site_id}/georeference"),
    ("PUT", "/sites/{site_id}/plan"),
    ("POST", "/sites/{site_id}/walks/{name}/withdraw"),
    ("DELETE", "/sites/{site_id}/walks/{name}"),
    ("GET", "/contributors/{contributor}/export"),
    ("DELETE", "/contributors/{contributor}"),
    ("POST", "/sites/{site_id}/build"),
}


def operations(app):
    for path, methods in app.openapi()["paths"].items():
        for method in methods:
            yield method.upper(), path


def filled(path):
    return path.replace("{site_id}", "office").replace("{version}", "1").replace("{", "").replace("}", "")


def test_every_operation_but_health_needs_a_key(service):
    asked = [(method, path) for method, path in operations(service.app) if path not in PUBLIC]
    assert len(asked) > 20
    for method, path in [*asked, ("GET", "/openapi.json")]:
        for headers in ({}, {"Authorization": "Bearer rs_wrong"}, {"X-API-Key": ""}):
            answer = service.client.request(method, filled(path), headers=headers)
            if path in PATHS:  # these APIs have their own shape
                assert answer.json()["error"]["errors"][0]["reason"] == "keyInvalid"
                continue
            assert answer.status_code == 401, (method, path, answer.text)
            assert set(answer.json()["error"]) == {"status", "kind", "message"}
    assert service.client.get("/health").json()["database"] == "ok"


def test_only_admins_reach_what_is_theirs(service):
    for method, path in operations(service.app):
        for role in ("upload", "read") if not path.endswith("/events") else ("upload",):  # readers may wait for ever
            answer = service.ask(method, filled(path), role=role, json={})
            if (method, path) in ADMIN_ONLY:
                assert answer.status_code == 403, (method, path, role, answer.text)


def test_uploaders_do_not_read_and_readers_do_not_upload(service):
    service.make_site()
    service.post("/sites/office/walks", {"name": "a"}, expect=403, role="read")
    service.ask("GET", "/sites/office/walks", role="upload", expect=403)
    service.post("/sites/office/locate", {"readings": []}, expect=403, role="upload")


@pytest.mark.parametrize("how", ["bearer", "header", "query"])
def test_a_key_comes_in_three_ways(service, how):
    key = service.keys["read"]
    ways = {
        "bearer": {"headers": {"Authorization": f"Bearer {key}"}},
        "header": {"headers": {"X-API-Key": key}},
        "query": {"params": {"key": key}},
    }
    assert service.client.get("/sites", **ways[how]).status_code == 200


def test_only_hashes_are_stored_and_removed_keys_end(service):
    database = service.context.database
    secret = add_key(database, "one more", "read")
    with database.read() as session:
        stored = session.get_one(Key, "one more")
    assert secret not in (stored.name, stored.role, stored.secret_sha256)
    assert [key.name for key in list_keys(database)] == ["admin", "one more", "read", "upload"]
    remove_key(database, "one more")
    assert service.client.get("/sites", headers={"X-API-Key": secret}).status_code == 401
    for call in (
        lambda: remove_key(database, "one more"),
        lambda: add_key(database, "read", "read"),
        lambda: add_key(database, "x", "king"),
        lambda: add_key(database, "a\nb", "read"),
    ):
        with pytest.raises(ConfigError, match="expected"):
            call()


def test_open_needs_no_keys_and_stays_on_loopback(tmp_path):
    settings = Settings(data=tmp_path, open=True, worker=False)
    with Service(settings) as service:
        assert service.client.get("/sites").json() == []
    with pytest.raises(ConfigError, match="--open only on"):
        serve(settings, "0.0.0.0", 0, lambda address: None)

"""Requests that make no sense: from the OpenAPI description, and bytes at random. No 500, no hang."""

from __future__ import annotations

import json
import os
import time

import pytest
import schemathesis
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from radioslam.server.replay import batches
from radioslam.server.settings import Settings
from radioslam.simulator import simulate
from tests.server.service import Service

EXAMPLES = int(os.environ.get("RADIOSLAM_MANGLED", "5"))
"""For each operation."""
LONGEST_S = 20.0
KNOWN = {"site_id": "office", "name": "office-00", "version": "latest"}
GENTLE = settings(
    max_examples=EXAMPLES,
    deadline=None,
    phases=[Phase.generate],
    suppress_health_check=list(HealthCheck),
    derandomize=True,
    database=None,
)
WALK = simulate("office", seed=1, walks=2)
BATCH = next(batch for _, batch in batches(WALK[0], 20.0))


@pytest.fixture(scope="module")
def service(tmp_path_factory):
    """With a site, walks and a map of the names that the requests use."""
    settings = Settings(data=tmp_path_factory.mktemp("mangled"), worker=False)
    with Service(settings) as one:
        one.make_site()
        for walk in WALK:
            one.send_walk(walk)
        one.build()
        yield one


def operations(service):
    found = schemathesis.openapi.from_dict(service.app.openapi()).get_all_operations()
    return [one.ok() for one in found if not one.ok().path.endswith("/events")]


def asked(service, case):
    """The answer to a case; names that exist are put in so that more than the path is looked at."""
    options = case.as_transport_kwargs(base_url="http://testserver")
    for name, value in KNOWN.items():
        if name in (case.path_parameters or {}) and case.method != "DELETE":
            case.path_parameters[name] = value
    options |= {"url": case.as_transport_kwargs(base_url="http://testserver")["url"]}
    headers = {**options.pop("headers", {}), "Authorization": f"Bearer {service.keys['admin']}"}
    headers = {key: value for key, value in headers.items() if str(value).isascii()}
    if "data" in options and isinstance(options["data"], bytes | str):
        options["content"] = options.pop("data")
    options.pop("cookies", None)
    return service.client.request(headers=headers, **options)


@pytest.mark.parametrize("known", [True, False], ids=["known names", "any names"])
def test_requests_from_the_description(service, known, monkeypatch):
    if not known:
        monkeypatch.setitem(globals(), "KNOWN", {})
    for operation in operations(service):

        @GENTLE
        @given(case=operation.as_strategy())
        def ask(case):
            started_s = time.perf_counter()
            answer = asked(service, case)
            assert answer.status_code < 500, (case.method, case.path, answer.text)
            assert time.perf_counter() - started_s < LONGEST_S

        ask()


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=4), inner, max_size=3),
    max_leaves=6,
)


def mangled(value, data):
    """One part of a message replaced by something else."""
    if isinstance(value, dict) and value and data.draw(st.integers(0, 3)):
        key = data.draw(st.sampled_from(sorted(value)))
        return {**value, key: mangled(value[key], data)}
    if isinstance(value, list) and value and data.draw(st.integers(0, 3)):
        k = data.draw(st.integers(0, len(value) - 1))
        return [*value[:k], mangled(value[k], data), *value[k + 1 :]]
    return data.draw(VALUES)


MESSAGES = {
    "/sites/office/walks/office-00/batches": BATCH,
    "/sites/office/locate": {"readings": BATCH["scans"][0]["readings"][:5]},
    "/v1/geolocate": {"wifiAccessPoints": [{"macAddress": "aa:bb:cc:00:00:01", "signalStrength": -50}] * 2},
    "/v2/geosubmit": {
        "items": [
            {
                "timestamp": 1_700_000_000_000,
                "position": {"latitude": 1.0, "longitude": 2.0},
                "wifiAccessPoints": [{"macAddress": "aa:bb:cc:00:00:01", "signalStrength": -50}] * 2,
            }
        ]
    },
    "/sites/office/sensor-logger": {
        "messageId": 1,
        "sessionId": "s",
        "deviceId": "d",
        "payload": [
            {"name": "accelerometer", "time": 10**18, "values": {"x": 1.0, "y": 2.0, "z": 3.0}},
            {"name": "wifi", "time": 10**18, "values": {"bssid": "aa:bb:cc:00:00:01", "level": -50, "ssid": "a"}},
        ],
    },
}


@pytest.mark.parametrize("path", MESSAGES)
def test_messages_with_a_part_replaced(service, path):
    @settings(GENTLE, max_examples=5 * EXAMPLES)
    @given(st.data())
    def ask(data):
        content = json.dumps(mangled(MESSAGES[path], data)).encode()
        answer = service.ask("POST", path, content=content, headers={"Content-Type": "application/json"})
        assert answer.status_code < 500, (content, answer.text)

    ask()


@pytest.mark.parametrize("path", [*MESSAGES, "/sites/office/files?name=a.zip", "/sites", "/sites/office/walks"])
def test_any_bytes(service, path):
    @settings(GENTLE, max_examples=2 * EXAMPLES)
    @given(
        st.binary(max_size=200) | st.binary(max_size=60).map(lambda tail: b"PK\x03\x04" + tail), st.binary(max_size=20)
    )
    def ask(content, kind):
        headers = {"Content-Type": kind.hex() or "application/json"}
        answer = service.ask("POST", path, content=content, headers=headers)
        assert answer.status_code < 500, (content, answer.text)

    ask()


def test_deep_and_huge_json(service):
    for content in (
        b"[" * 100_000,
        b'{"a":' * 50_000,
        b"1" * 100_000,
        b'{"sequence": 1e999}',
        b'{"sequence": 9' + b"9" * 5000 + b"}",
    ):
        for path in MESSAGES:
            headers = {"Content-Type": "application/json"}
            answer = service.ask("POST", path, content=content, headers=headers)
            assert answer.status_code < 500, (content[:20], answer.text)

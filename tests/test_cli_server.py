"""The service's commands as people type them."""

from __future__ import annotations

import json
import socket
import subprocess
import sys

import pytest

pytest.importorskip("fastapi", reason="the service needs radioslam[server]")

from radioslam.formats import write_walk
from radioslam.simulator import simulate
from tests.command_line import run
from tests.server.processes import ServerProcess


def test_keys_are_made_listed_and_removed(capsys, tmp_path):
    data = ("--data", tmp_path / "data")
    code, secret, _ = run(capsys, "keys", "add", "phones", *data)
    assert code == 0
    assert secret.startswith("rs_")
    run(capsys, "keys", "add", "boss", "--role", "admin", *data)
    assert run(capsys, "keys", "list", *data)[1] == "boss\tadmin\nphones\tupload\n"
    assert run(capsys, "keys", "add", "phones", *data)[0] == 1
    assert run(capsys, "keys", "remove", "phones", *data)[0] == 0
    code, _, message = run(capsys, "keys", "remove", "phones", *data)
    assert code == 1
    assert "expected the name of a key" in message


def test_replay_tells_what_it_saw(capsys, tmp_path):
    for walk in simulate("office", seed=1, walks=2):
        write_walk(walk, tmp_path / "walks")
    with ServerProcess(tmp_path / "data") as server:
        arguments = ("--to", server.url, "--site", "office", "--speed", "200", "--phones", "3")
        code, out, _ = run(capsys, "replay", tmp_path / "walks", *arguments)
        assert code == 0
        told = json.loads(out)
        walks = server.ask("/sites/office/walks")[1]
    assert [walk["name"] for walk in walks] == ["office-00", "office-00-1", "office-01"]
    assert {walk["state"] for walk in walks} == {"finished"}
    assert told["batches"] == sum(walk["batches"] for walk in walks)
    assert set(told["answers"]) <= {"200", "201"}


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("serve", "--open", "--host", "0.0.0.0"), "--open only on"),
        (("serve", "--database", "mysql://x"), "expected a database URL"),
        (("serve", "--host", "192.0.2.1"), "expected an address that is free"),
        (("keys", "add", "a", "--role", "king"), "expected a role of"),
    ],
)
def test_what_cannot_be_is_one_line(capsys, tmp_path, arguments, says):
    code, _, message = run(capsys, *arguments, "--data", tmp_path)
    assert code == 1
    assert says in message
    assert "\n" not in message.strip()


def test_without_the_extra_one_line_says_what_to_install(capsys, tmp_path, monkeypatch):
    import importlib.util

    found = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "fastapi" else found(name))
    code, _, message = run(capsys, "serve", "--data", tmp_path)
    assert code == 1
    assert "pip install 'radioslam[server]'" in message


def test_the_demo_serves_a_crowd(tmp_path):
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    options = ["--data", str(tmp_path / "demo"), "--port", str(port), "--walks", "2", "--speed", "100", "--no-stay"]
    command = [sys.executable, "-m", "radioslam", "serve-demo", *options]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    assert f"watch it at http://127.0.0.1:{port}" in done.stdout
    assert "the crowd is through" in done.stdout

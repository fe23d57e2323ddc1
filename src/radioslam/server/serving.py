"""The application on a socket; the one file that knows uvicorn."""

from __future__ import annotations

import logging
import socket
from collections.abc import Callable

import uvicorn

from radioslam.errors import ConfigError
from radioslam.server.app import create_app
from radioslam.server.settings import LOOPBACK, Settings

IDLE_S = 30
LAST_REQUESTS_S = 3
MOST_CONNECTIONS = 2000


def serve(settings: Settings, host: str, port: int, ready: Callable[[str], None]) -> None:
    """Serve until a signal ends it; ``ready`` is told the address once connections are taken. Port 0: any.

    Raises:
        ConfigError: open to everybody beyond loopback, or the address cannot be listened on.
        UnavailableError: the database does not answer.
    """
    if settings.open and host not in LOOPBACK:
        raise ConfigError(f"expected --open only on {LOOPBACK[0]}, found --host {host}; make keys instead")
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(name)s: %(message)s")
    logging.getLogger("alembic").setLevel(logging.WARNING)
    app = create_app(settings)
    listening = _listen(host, port)
    config = uvicorn.Config(
        app,
        access_log=False,  # addresses can hold keys
        log_level="warning",
        server_header=False,
        timeout_keep_alive=IDLE_S,
        timeout_graceful_shutdown=LAST_REQUESTS_S,
        limit_concurrency=MOST_CONNECTIONS,
    )
    ready(f"http://{f'[{host}]' if ':' in host else host}:{listening.getsockname()[1]}")
    uvicorn.Server(config).run(sockets=[listening])


def _listen(host: str, port: int) -> socket.socket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listening = socket.socket(family, socket.SOCK_STREAM)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind((host, port))
    except OSError as error:
        listening.close()
        raise ConfigError(f"expected an address that is free, found {host}:{port}: {error.strerror}") from None
    listening.listen(1024)
    return listening

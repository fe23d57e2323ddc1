"""The web page: static files without data, Plotly's script from its package, and the headers of both."""

from __future__ import annotations

import gzip
from functools import lru_cache
from pathlib import Path

from fastapi import FastAPI, Request, Response
from starlette.concurrency import run_in_threadpool
from starlette.responses import RedirectResponse
from starlette.staticfiles import StaticFiles
from starlette.types import Scope

FOLDER = Path(__file__).parent / "page"
POLICY = {
    "default-src": "'none'",
    "script-src": "'self'",
    "style-src": "'self'",
    "img-src": "'self' data:",  # Plotly draws heat maps and floor images as data
    "connect-src": "'self'",
    "base-uri": "'none'",
    "form-action": "'none'",
    "frame-ancestors": "'none'",
}
HEADERS = {
    "Content-Security-Policy": "; ".join(f"{kind} {source}" for kind, source in POLICY.items()),
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-cache",
}
SCRIPT_HEADERS = {"Cache-Control": "max-age=86400", "Vary": "Accept-Encoding", "X-Content-Type-Options": "nosniff"}


class _PageFiles(StaticFiles):
    async def get_response(self, path: str, scope: Scope) -> Response:
        response = await super().get_response(path, scope)
        response.headers.update(HEADERS)
        return response


def mount_page(app: FastAPI) -> None:
    """Serve the page at ``/page/``, where ``/`` leads."""
    app.add_route("/", _root)
    app.add_route("/page/plotly.min.js", _plotly)
    app.mount("/page", _PageFiles(directory=FOLDER, html=True))


async def _root(_: Request) -> Response:
    return RedirectResponse("page/", headers=HEADERS)


async def _plotly(request: Request) -> Response:
    packed = "gzip" in request.headers.get("accept-encoding", "")
    content = await run_in_threadpool(_script, packed)
    encoding = {"Content-Encoding": "gzip"} if packed else {}
    return Response(content, media_type="text/javascript", headers=SCRIPT_HEADERS | encoding)


@lru_cache(maxsize=2)
def _script(packed: bool) -> bytes:
    from plotly.offline import get_plotlyjs

    script = get_plotlyjs().encode()
    return gzip.compress(script, 6) if packed else script

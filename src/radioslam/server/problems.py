"""Exception -> status, and the one shape of errors: ``{"error": {"status", "kind", "message"}}``."""

from __future__ import annotations

import logging
from http import HTTPStatus

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.responses import JSONResponse

from radioslam import errors
from radioslam.server.door_problems import PATHS, door_answer

STATUS: tuple[tuple[type[Exception], int], ...] = (
    (errors.UnauthorizedError, 401),
    (errors.ForbiddenError, 403),
    (errors.NotFoundError, 404),
    (errors.ConflictError, 409),
    (errors.TooLargeError, 413),
    (errors.TooFastError, 429),
    (errors.UnavailableError, 503),
    (errors.RadioSlamError, 422),
)
"""The first that fits counts."""
SHOWN_PROBLEMS = 5
_log = logging.getLogger("radioslam.server")


def status_of(error: Exception) -> int:
    """The HTTP status of an error; what nobody raised on purpose is 500."""
    return next((status for kind, status in STATUS if isinstance(error, kind)), 500)


def problem(status: int, message: str, headers: dict[str, str] | None = None) -> JSONResponse:
    """An error's response."""
    kind = HTTPStatus(status).phrase.lower().replace(" ", "-")
    body = {"error": {"status": status, "kind": kind, "message": " ".join(message.split())}}
    return JSONResponse(body, status, headers)


def answer(error: Exception, path: str) -> JSONResponse:
    """What a client of a path is told of an error; of a bug only that there is one."""
    status = status_of(error)
    if path in PATHS:
        return door_answer(error, status)
    headers = {401: {"WWW-Authenticate": "Bearer"}, 429: {"Retry-After": "1"}, 503: {"Retry-After": "2"}}.get(status)
    if status == 500:
        return problem(status, "the service failed; its log says why")
    if status == 503:
        _log.warning("%s (%s)", error, error.__cause__)
    return problem(status, str(error), headers)


def install(app: FastAPI) -> None:
    """Let the application answer errors so."""

    async def known(request: Request, error: Exception) -> JSONResponse:
        return answer(error, request.url.path)

    async def of_http(_: Request, error: Exception) -> JSONResponse:
        assert isinstance(error, HTTPException)
        headers = dict(error.headers or {})
        return problem(error.status_code, str(error.detail), headers)

    async def invalid(_: Request, error: Exception) -> JSONResponse:
        assert isinstance(error, RequestValidationError)
        return problem(422, _validation(error))

    app.add_exception_handler(errors.RadioSlamError, known)
    app.add_exception_handler(HTTPException, of_http)
    app.add_exception_handler(RequestValidationError, invalid)
    app.add_exception_handler(Exception, known)


def _validation(error: RequestValidationError) -> str:
    found = error.errors()
    shown = [f"{'.'.join(str(part) for part in one['loc'])}: {one['msg']}" for one in found[:SHOWN_PROBLEMS]]
    more = f"; and {len(found) - SHOWN_PROBLEMS} more" if len(found) > SHOWN_PROBLEMS else ""
    return "; ".join(shown).encode("utf-8", "replace").decode() + more

"""Errors in the shape of the location APIs of Google and Mozilla's ichnaea, for clients that know those.

``{"error": {"errors": [{"domain", "reason", "message"}], "code", "message"}}``
"""

from __future__ import annotations

from starlette.responses import JSONResponse

from radioslam.errors import DoorError, ForbiddenError, TooFastError, TooLargeError, UnauthorizedError

PATHS = ("/v1/geolocate", "/v2/geosubmit")
_KEY = (400, "usageLimits", "keyInvalid", "Missing or invalid API key.")
_PARSE = (400, "global", "parseError", "Parse Error")
_NOT_FOUND = (404, "geolocation", "notFound", "Not found")
_LIMIT = (403, "usageLimits", "dailyLimitExceeded", "You have exceeded your daily limit.")
_AWAY = (503, "global", "backendError", "Service Unavailable")


def door_answer(error: Exception, status: int) -> JSONResponse:
    """The answer to an error whose own status would be ``status``."""
    code, domain, reason, message = _told(error, status)
    shown = {"domain": domain, "reason": reason, "message": message}
    return JSONResponse({"error": {"errors": [shown], "code": code, "message": message}}, code)


def _told(error: Exception, status: int) -> tuple[int, str, str, str]:
    if isinstance(error, UnauthorizedError | ForbiddenError):
        return _KEY
    if isinstance(error, TooFastError):
        return _LIMIT
    if isinstance(error, DoorError):
        return _NOT_FOUND if error.reason == "notFound" else _PARSE
    if isinstance(error, TooLargeError):
        return 413, "global", "parseError", "Request Entity Too Large"
    if status >= 500:
        return status, *_AWAY[1:]
    return _PARSE if status in (400, 422) else (status, "global", "backendError", "Error")

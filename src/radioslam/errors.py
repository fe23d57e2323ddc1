"""Everything that RadioSLAM raises on purpose.

    RadioSlamError
    ├── LogError        a recording cannot be read or makes no sense
    ├── ConfigError     an unknown key, or a value out of range
    ├── MappingError    these walks cannot be mapped
    │   └── GraphError  the pose graph is not one that can be solved
    ├── PositioningError  a scan cannot be placed in a map
    ├── DoorError       a request to a location API is none, or cannot be answered
    ├── ResultError     a result folder cannot be written or read
    └── ServiceError    a request to the service cannot be met
        ├── UnauthorizedError  no key, or one that is not known
        ├── ForbiddenError     the key's role does not reach so far
        ├── NotFoundError      no such site, walk, map
        ├── ConflictError      it contradicts what was accepted before
        ├── TooLargeError      more than a limit allows
        ├── TooFastError       more requests than a key is allowed
        └── UnavailableError   for now: the database or the map is not there

Each message is one line: what was expected, what came, what to do.
"""

from __future__ import annotations

from pathlib import Path


class RadioSlamError(Exception):
    """Root of the tree; catch it to catch whatever this package raises on purpose."""


class LogError(RadioSlamError):
    """A recording cannot be read.

    Attributes:
        path: the file, line: its line (1-based) or None where the file as a whole is meant.
    """

    def __init__(self, path: Path | str, expected: str, found: str, advice: str = "", line: int | None = None) -> None:
        self.path, self.line = Path(path), line
        place = f"{path}:{line}" if line else f"{path}"
        super().__init__(f"{place}: expected {expected}, found {found}" + (f"; {advice}" if advice else ""))

    def __reduce__(self) -> tuple[object, ...]:
        """Let the error cross process borders with its message."""
        return (_rebuild_log_error, (str(self), self.path, self.line))


def _rebuild_log_error(message: str, path: Path, line: int | None) -> LogError:
    error = LogError.__new__(LogError)
    RadioSlamError.__init__(error, message)
    error.path, error.line = path, line
    return error


class ConfigError(RadioSlamError):
    """The configuration has an unknown key or a value out of range."""


class MappingError(RadioSlamError):
    """The walks given cannot be made into a map."""


class GraphError(MappingError):
    """The pose graph is malformed: indices, information matrices or duplicate edges."""


class ResultError(RadioSlamError):
    """A result folder cannot be written, or is not one."""


class PositioningError(RadioSlamError):
    """A scan or a map cannot be used for positioning."""


class ServiceError(RadioSlamError):
    """A request to the service cannot be met."""


class UnauthorizedError(ServiceError):
    """No API key, or one that is not known."""


class ForbiddenError(ServiceError):
    """The API key's role does not reach so far."""


class NotFoundError(ServiceError):
    """There is no such thing."""


class ConflictError(ServiceError):
    """The request contradicts what was accepted before."""


class TooLargeError(ServiceError):
    """More bytes, or more of anything, than a limit allows."""


class TooFastError(ServiceError):
    """More requests in a time than a key is allowed."""


class UnavailableError(ServiceError):
    """What is needed is not there for now; ask again."""


class DoorError(RadioSlamError):
    """A request to one of the location APIs is not as they have it, or asks what cannot be answered.

    Attributes:
        reason: ``parseError`` or ``notFound``, the word by which these APIs name it.
    """

    def __init__(self, reason: str, message: str) -> None:
        self.reason = reason
        super().__init__(message)

    def __reduce__(self) -> tuple[object, ...]:
        """Let the error cross process borders with its reason."""
        return (DoorError, (self.reason, str(self)))

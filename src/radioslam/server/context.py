"""What the parts of one running application share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from fastapi import Request

from radioslam.server.database import Database
from radioslam.server.group_commit import GroupCommit
from radioslam.server.privacy import Hide
from radioslam.server.settings import Settings

if TYPE_CHECKING:
    from radioslam.server.access import KeyMemory
    from radioslam.server.journal import Incoming
    from radioslam.server.limits import Rates
    from radioslam.server.live import Broadcast
    from radioslam.server.positions import Positioners, Sessions
    from radioslam.server.supervisor import Supervisor


@dataclass(frozen=True)
class Context:
    """Settings, database and the memory of one application."""

    settings: Settings
    database: Database
    journal: GroupCommit[Incoming, bool]
    hide: Hide
    keys: KeyMemory
    rates: Rates
    live: Broadcast
    positioners: Positioners
    sessions: Sessions
    supervisor: Supervisor


def context_of(request: Request) -> Context:
    """The context of the application that answers."""
    context: Context = request.app.state.context
    return context

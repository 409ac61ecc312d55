"""The page, opened and kept open."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import viser

from sixpoint.errors import FormatError
from sixpoint.jobs.view.clips import Clip
from sixpoint.jobs.view.inbox import Inbox
from sixpoint.jobs.view.posing import Posing
from sixpoint.jobs.view.session import Session
from sixpoint.solvers.registry import SOLVERS
from sixpoint.viewer import Panel, Scene, describe_address, open_server
from sixpoint.viewer.server import HOST, close


@dataclass(frozen=True, eq=False)
class Page:
    """A page that is open.

    Attributes:
        server: What browsers talk to.
        session: What happens there.
        address: Where to point a browser.
        warning: What it means that others can reach it; empty where they cannot.
    """

    server: viser.ViserServer
    session: Session
    address: str
    warning: str


@contextmanager
def open_page(
    clips: Sequence[Clip],
    *,
    posing: Posing | None = None,
    host: str = HOST,
    port: int | None = None,
    folder: Path | None = None,
) -> Iterator[Page]:
    """Open the page; it is served, and what is dragged is solved, until the context ends.

    Args:
        clips: What can be looked at.
        posing: Method and settings to begin with.
        host: Address to listen on.
        port: Where; None: the first free one from 8080.
        folder: Where poses and motions may be saved; None for nowhere.

    Raises:
        SixpointError: The port is taken, the folder does not exist, or the method makes no sense.
    """
    posing = posing or Posing()
    if folder is not None and not folder.is_dir():
        raise FormatError(folder, "this is no folder to save into; create it first")
    posing.make(clips[0].figure)  # before the port is taken
    server = open_server(host, port)
    inbox = Inbox()
    try:
        methods = [*SOLVERS] if posing.method in SOLVERS else [*SOLVERS, posing.method]
        panel = Panel(server, inbox.put, [c.name for c in clips], methods, posing.method, folder is not None)
        session = Session(clips, posing, Scene(server, inbox.put), panel, inbox, folder)
        worker = threading.Thread(target=session.run, name="sixpoint page", daemon=True)
        worker.start()
        try:
            yield Page(server, session, *describe_address(server))
        finally:
            inbox.close()
            worker.join(5.0)
    finally:
        close(server)

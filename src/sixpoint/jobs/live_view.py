"""A page that shows a live session: the posed body and the six points, as often as a browser can follow.

The live loop only leaves its newest frame here and goes on; a thread of this page's own draws it.
"""

from __future__ import annotations

import contextlib
import threading

import numpy as np
import viser

from sixpoint.body.figure import Figure
from sixpoint.live.loop import Channel
from sixpoint.live.session import Frame
from sixpoint.viewer.scene import Scene
from sixpoint.viewer.server import close, describe_address, open_server

RATE = 30.0  # Hz, pictures sent to browsers


class LiveView:
    """The page of one channel.

    Args:
        figure: Who is posed at the beginning.
        host: Address to listen on.

    Attributes:
        address: Where the page is, and what that address means for others.

    Raises:
        SixpointError: The address is not this machine's.
    """

    def __init__(self, figure: Figure, host: str = "127.0.0.1") -> None:
        self._server: viser.ViserServer = open_server(host)
        self._scene = Scene(self._server, lambda what, value: None)
        self._scene.set_figure(figure)
        self._line = self._server.gui.add_markdown("waiting for trackers")
        self.address = describe_address(self._server)
        self._newest: tuple[Channel, Frame] | None = None
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._draw, daemon=True)
        self._thread.start()

    def watch(self, channel: Channel, frame: Frame) -> None:
        """Take the newest frame; returns at once."""
        self._newest = (channel, frame)

    def close(self) -> None:
        """Close the page."""
        self._stop.set()
        self._thread.join(2.0)
        close(self._server)

    def _draw(self) -> None:
        while not self._stop.wait(1.0 / RATE):
            newest, self._newest = self._newest, None
            if newest is None:
                continue
            with contextlib.suppress(Exception):  # a browser that leaves in the middle must not end the page
                self._show(*newest)

    def _show(self, channel: Channel, frame: Frame) -> None:
        figure = channel.session.figure
        if self._scene.figure is not figure:
            self._scene.set_figure(figure)
        with self._server.atomic():
            self._scene.show(*frame.pose.compute_transforms())
            self._scene.set_targets(np.asarray(frame.tracked.positions))
            self._line.content = channel.statistics.line()

"""Where the page listens. The client is shipped with viser: no browser asks anybody but this server."""

from __future__ import annotations

import contextlib
import io
import ipaddress
import socket

import viser

from sixpoint.errors import SixpointError

HOST, PORT = "127.0.0.1", 8080
NEXT = 100  # ports tried after one that is taken


class LocalServer(viser.ViserServer):
    """A server that opens no tunnel to the outside, whatever a browser asks for."""

    def request_share_url(self, verbose: bool = True) -> None:
        """Never: a page must not be able to publish this machine."""


def open_server(host: str = HOST, port: int | None = None) -> viser.ViserServer:
    """Listen.

    Args:
        host: Address to listen on.
        port: Where; None: the first free one from ``PORT``.

    Raises:
        SixpointError: The address is not this machine's, or the port is taken; the message names a free one.
    """
    if port is not None and not 1 <= port <= 65535:
        raise SixpointError(f"a port is a number from 1 to 65535, got {port}")
    free = find_port(host, PORT if port is None else port)
    if port is not None and free != port:
        raise SixpointError(f"port {port} is in use on {host}; free: --port {free}")
    # viser greets on stdout, which belongs to the command line
    with contextlib.redirect_stdout(io.StringIO()):
        server = LocalServer(host=host, port=free, label="sixpoint", verbose=False)
    if server.get_port() != free:  # somebody was faster
        taken = server.get_port()
        if port is not None:
            close(server)
            raise SixpointError(f"port {port} is in use on {host}; free: --port {taken}")
    return server


def close(server: viser.ViserServer) -> None:
    """Stop listening; browsers say that the connection is lost."""
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()


def find_port(host: str, first: int) -> int:
    """The first free port from ``first``.

    Raises:
        SixpointError: The address is not this machine's, or none of many ports is free.
    """
    try:
        found = socket.getaddrinfo(host, first, type=socket.SOCK_STREAM)
    except OSError as error:
        raise SixpointError(f"cannot listen on {host!r}: {error.strerror or error}") from None
    family, kind, protocol, _, address = found[0]
    for port in range(first, min(first + NEXT, 65536)):
        with socket.socket(family, kind, protocol) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind((address[0], port))
            except PermissionError:
                continue
            except OSError as error:
                if error.errno == 99:  # EADDRNOTAVAIL
                    raise SixpointError(f"{host} is no address of this machine; try {HOST}") from None
                continue
        return port
    raise SixpointError(f"no free port from {first} on {host}; give another with --port")


def is_public(host: str) -> bool:
    """Whether others than this machine can reach an address."""
    try:
        return not ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host != "localhost"


def describe_address(server: viser.ViserServer) -> tuple[str, str]:
    """The page's address, and what it means that others can reach it (empty where they cannot)."""
    host, port = server.get_host(), server.get_port()
    shown = "localhost" if host in ("0.0.0.0", "::") else f"[{host}]" if ":" in host else host
    warning = (
        "everyone who can reach this machine can open the page, see the recordings, drag the figure and save "
        "poses where you allowed it: there is no password and no encryption; leave --host out to keep it here"
    )
    return f"http://{shown}:{port}", warning if is_public(host) else ""

"""A socket to listen on, taken before anything else is started."""

import errno
import socket

from app.cli.console import Failed


def listen(host: str, port: int) -> socket.socket:
    """Take a port; 0 takes any that is free."""
    try:
        family, _, _, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        taken = socket.create_server(address[:2], family=family)
    except OSError as error:
        raise Failed(_why(host, port, error)) from error
    taken.set_inheritable(True)
    return taken


def _why(host: str, port: int, error: OSError) -> str:
    if error.errno == errno.EADDRINUSE:
        choose = "Choose another with --port or ENCORE_PORT."
        return f"Port {port} of {host} is in use. {choose}"
    reason = str(error.strerror or error).partition(" (while")[0]  # names it again
    return f"Port {port} of {host} cannot be had: {reason}."


def listen_near(host: str, port: int, tries: int = 20) -> socket.socket:
    """Take a port, or one of those that follow it."""
    for candidate in range(port, port + tries):
        try:
            return listen(host, candidate)
        except Failed:
            continue
    raise Failed(f"None of the ports {port} to {port + tries - 1} of {host} is free.")


def address(taken: socket.socket) -> str:
    """The address by which a browser on this machine reaches a socket."""
    host, port = taken.getsockname()[:2]
    if host in {"0.0.0.0", "::"}:  # noqa: S104 - asked about, not listened on
        host = "127.0.0.1"
    return f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}"

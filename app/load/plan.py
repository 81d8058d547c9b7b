"""What a load is to be, as every process that makes it is told."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from urllib.parse import quote, urlsplit


@dataclass(frozen=True, slots=True)
class Target:
    """Where the service is.

    prefix: of the path, where it does not begin at the root
    """

    host: str
    port: int
    tls: bool
    prefix: str

    @classmethod
    def of(cls, url: str) -> "Target":
        """The service at an address; ValueError: it is none."""
        parts = urlsplit(url)
        if parts.scheme not in {"http", "https"} or not parts.hostname:
            raise ValueError(f"{url!r} is no address of a service: http://HOST:PORT")
        tls = parts.scheme == "https"
        port = parts.port or (443 if tls else 80)
        return cls(parts.hostname, port, tls, parts.path.rstrip("/"))


@dataclass(frozen=True, slots=True)
class Plan:
    """Who asks, where, and how.

    users:       listeners by name
    connections: how many requests are on their way at a time, at most
    fresh:       the service has never heard of these users
    repeats:     share of requests that are sent a second time, though answered
    clock:       slots may also move on by the clock
    patience:    seconds that an answer may take
    """

    target: Target
    key: str = field(repr=False)
    users: Sequence[str]
    connections: int
    fresh: bool = True
    repeats: float = 0.0
    clock: bool = False
    patience: float = 30.0
    seed: int = 0

    def share(self, number: int, processes: int) -> "Plan":
        """The part of one of several processes."""
        whole, rest = divmod(self.connections, processes)
        return replace(
            self,
            users=self.users[number::processes],
            connections=whole + (number < rest),
            seed=self.seed + number,
        )

    def request(self, method: str, path: str, body: str = "") -> bytes:
        """A request as it is sent."""
        target = self.target
        content = (
            f"Content-Type: application/json\r\nContent-Length: {len(body)}\r\n"
            if body
            else ""
        )
        return (
            f"{method} {target.prefix}{path} HTTP/1.1\r\n"
            f"Host: {target.host}:{target.port}\r\n"
            f"Authorization: Bearer {self.key}\r\n{content}\r\n{body}"
        ).encode()


@dataclass(frozen=True, slots=True)
class Wishes:
    """How often the service is to be asked, and for how long.

    rate:    requests a second; None: a share of what the service can answer
    seconds: for how long
    even:    requests come in equal steps of time, else at random
    keep:    leave the users in the service
    """

    rate: float | None
    share: float
    seconds: float
    even: bool
    keep: bool


def path_of(user: str) -> str:
    """The path of what belongs to a user."""
    return f"/v1/users/{quote(user, safe='')}"

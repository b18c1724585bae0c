"""Who may look, and who may move the rig. Another web page open in the same browser may do neither."""

from __future__ import annotations

import hmac
import ipaddress
import secrets
import socket
from dataclasses import dataclass, field
from urllib.parse import urlsplit


def is_loopback(host: str) -> bool:
    """Whether an address is of this machine alone."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def own_names() -> frozenset[str]:
    """Names that this machine goes by."""
    name = socket.gethostname().lower()
    return frozenset({name, name.partition(".")[0], f"{name.partition('.')[0]}.local"})


@dataclass(frozen=True)
class Access:
    """Rules of one server.

    A name of somebody else that leads to this machine (DNS rebinding) is refused by the `Host` header, a foreign page's
    websocket by its `Origin`; to move the rig takes the token, which only the printed address has.
    """

    host: str
    """The address that the server is bound to."""
    names: frozenset[str] = frozenset()
    """Further names under which the page may be opened."""
    token: str = field(default_factory=lambda: secrets.token_urlsafe(18), repr=False)

    def host_allowed(self, header: str) -> bool:
        """Whether a request's `Host` is an address or a name of this server."""
        name = _hostname(f"//{header}")
        if name is None:
            return False
        if is_loopback(name) or name in self.names:
            return True
        if is_loopback(self.host):
            return False
        try:
            ipaddress.ip_address(name)
        except ValueError:
            return name in own_names()
        return True

    def origin_allowed(self, origin: str, host: str) -> bool:
        """Whether a websocket is opened by a page that this server served."""
        try:
            parts = urlsplit(origin)
        except ValueError:
            return False
        return parts.scheme == "http" and parts.netloc.lower() == host.lower() and self.host_allowed(host)

    def may_command(self, token: str) -> bool:
        """Whether this is the token."""
        return hmac.compare_digest(token.encode(), self.token.encode())

    def warning(self) -> str | None:
        """What the address that is served on lets others do; None on this machine alone."""
        if is_loopback(self.host):
            return None
        return f"on {self.host} the whole network may look on, and stop; to move takes the address that is printed"

    def address(self, port: int) -> str:
        """What to open in the browser; the token stands behind `#`, which no browser sends anywhere."""
        if self.host in {"0.0.0.0", "::"}:  # noqa: S104 - said by the user
            shown = socket.gethostname()
        else:
            shown = f"[{self.host}]" if ":" in self.host else self.host
        return f"http://{shown}:{port}/#token={self.token}"


def _hostname(address: str) -> str | None:
    try:
        return urlsplit(address).hostname
    except ValueError:
        return None

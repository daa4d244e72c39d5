"""Who may look at the page, and who may act on it.

This machine may do both. Others on the network may look if the scene says so, by a link with a
token that is made anew for each run; they may act only if the scene says that too.
"""

from __future__ import annotations

import hmac
import ipaddress
import secrets
from dataclasses import dataclass
from urllib.parse import urlsplit

LOOPBACK = {"127.0.0.1", "localhost", "::1"}


@dataclass(frozen=True)
class Access:
    """What the scene allows.

    Attributes
    ----------
    token : str or None
        What others must know to look; None keeps them out.
    control : bool
        Whether those who know it may act as well.
    """

    token: str | None = None
    control: bool = False

    def knows(self, given: str) -> bool:
        """Whether `given` is the token; takes as long for a near miss as for a far one."""
        return self.token is not None and hmac.compare_digest(self.token.encode(), given.encode())


def new_token() -> str:
    """Make a token that nobody guesses."""
    return secrets.token_urlsafe(16)


def is_own(host: str, origin: str | None) -> bool:
    """Whether a request to `host` from a page of `origin` is one of our own page's."""
    try:
        name = urlsplit(f"//{host}").hostname
    except ValueError:
        return False
    return name in LOOPBACK and same_page(host, origin)


def same_page(host: str, origin: str | None) -> bool:
    """Whether a request comes from the page itself, or from no page at all."""
    return origin in (None, f"http://{host}")


def is_local(address: str) -> bool:
    """Whether a peer's address is one of this machine's loopback."""
    try:
        return ipaddress.ip_address(address).is_loopback
    except ValueError:
        return False

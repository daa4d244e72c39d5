"""Who may look at the page, and who may act on it.

This machine may do both, by a link with a token where it has other users. Others on the network may
look if the scene says so, by such a link too; they may act only if the scene says that as well. The
token is made anew for each run.
"""

from __future__ import annotations

import hmac
import ipaddress
import os
import secrets
import sys
from dataclasses import dataclass
from typing import Literal
from urllib.parse import urlsplit

PEOPLE = (500 if sys.platform == "darwin" else 1000, 60_000)  # numbers of people's accounts
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
    network : bool
        Whether the port is open to the network, for those who know the token.
    alone : bool
        Whether everyone on this machine may look and act without the token.
    """

    token: str | None = None
    control: bool = False
    network: bool = True
    alone: bool = True

    @property
    def everywhere(self) -> bool:
        """Whether the port is open to the network."""
        return self.network and self.token is not None

    def knows(self, given: str) -> bool:
        """Whether `given` is the token; takes as long for a near miss as for a far one."""
        return self.token is not None and hmac.compare_digest(self.token.encode(), given.encode())


def access_of(viewers: Literal["user", "machine", "network"], control: bool) -> Access:
    """Return who may come in, by what a scene says of the page's viewers and of their control."""
    alone = viewers == "machine" or not has_other_users()
    network = viewers == "network"
    return Access(new_token() if network or not alone else None, control, network, alone)


def has_other_users() -> bool:
    """Whether other people have an account on this machine; False where the system says nothing."""
    try:
        import pwd
    except ImportError:
        return False
    own = os.getuid()
    return any(
        entry.pw_uid != own
        and PEOPLE[0] <= entry.pw_uid < PEOPLE[1]
        and not entry.pw_shell.endswith(("nologin", "false"))
        for entry in pwd.getpwall()
    )


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

"""Who comes through the guard: this machine by its own name, and others by the token alone."""

import asyncio

import pytest

from rig.web.access import Access
from rig.web.guard import CONTROLS, Guard

OWN = ("127.0.0.1", 50000)
OTHER = ("192.0.2.7", 50000)


COOKIE = "touchplate-8765=secret"


def request(access, peer, host, query="", cookie=""):
    """Send a request through the guard; gives its status, and whether it may act."""
    passed, sent = [], []

    async def application(scope, receive, send):
        passed.append(scope[CONTROLS])
        await send({"type": "http.response.start", "status": 200, "headers": []})

    async def send(message):
        sent.append(message)

    scope = {
        "type": "http", "method": "GET", "path": "/", "query_string": query.encode(),
        "headers": [(b"host", host.encode()), (b"cookie", cookie.encode())], "client": peer,
        "server": ("127.0.0.1", 8765),
    }  # fmt: skip
    asyncio.run(Guard(application, access)(scope, None, send))
    return sent[0]["status"], passed[0] if passed else None


@pytest.mark.parametrize("access", [Access(), Access("secret"), Access("secret", control=True)])
def test_who_says_our_loopback_name_from_elsewhere_stays_out(access):
    assert request(access, OTHER, "127.0.0.1:8765") == (403, None)
    assert request(access, OTHER, "localhost") == (403, None)
    assert request(access, OWN, "127.0.0.1:8765") == (200, True)


@pytest.mark.parametrize("control", [False, True])
def test_a_token_lets_others_look_and_act_only_if_the_scene_says_so(control):
    access = Access("secret", control)
    assert request(access, OTHER, "bench:8765", cookie=COOKIE) == (200, control)
    assert request(access, OTHER, "bench:8765", "token=secret") == (303, None)
    assert request(access, OTHER, "bench:8765", "token=secre") == (403, None)
    assert request(access, OTHER, "bench:8765") == (403, None)
    assert request(Access(), OTHER, "bench:8765", "token=") == (403, None)

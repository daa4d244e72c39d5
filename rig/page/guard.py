"""Keep the page on this machine: what does not come from the page itself is refused.

A server on a loopback address is still within reach of any web site that the user has open. The
browser says where a request comes from, so the name that it was sent to must be a loopback name
(against DNS rebinding), and its origin, where there is one, must be the page itself.
"""

from urllib.parse import urlsplit

from starlette.datastructures import Headers
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

LOOPBACK = {"127.0.0.1", "localhost", "::1"}
PROTECTION = [
    (b"content-security-policy", b"default-src 'self'; img-src 'self' data:; "
     b"frame-ancestors 'none'; base-uri 'none'; form-action 'none'"),
    (b"x-content-type-options", b"nosniff"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"referrer-policy", b"no-referrer"),
    (b"cache-control", b"no-cache"),
]  # fmt: skip


def is_own(host: str, origin: str | None) -> bool:
    """Whether a request to `host` from a page of `origin` is one of our own page's."""
    try:
        name = urlsplit(f"//{host}").hostname
    except ValueError:
        return False
    return name in LOOPBACK and origin in (None, f"http://{host}")


class Guard:
    """ASGI layer that answers 403 to foreign requests and adds the protecting headers."""

    def __init__(self, app: ASGIApp):
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass own requests on; refuse the others, a websocket before it is accepted."""
        if scope["type"] == "lifespan":
            return await self.app(scope, receive, send)
        headers = Headers(scope=scope)
        if is_own(headers.get("host", ""), headers.get("origin")):
            return await self.app(scope, receive, _protecting(send))
        if scope["type"] == "websocket":
            return await send({"type": "websocket.close", "code": 1008})
        refusal = PlainTextResponse(
            "this page answers only on its loopback address; open it as http://127.0.0.1\n", 403
        )
        return await refusal(scope, receive, send)


def _protecting(send: Send) -> Send:
    async def protected(message: Message) -> None:
        if message["type"] == "http.response.start":
            message["headers"] = [*message.get("headers", []), *PROTECTION]
        await send(message)

    return protected

"""Keep the page to those who may see it: every other request is refused.

A server on a loopback address is still within reach of any web site that the user has open. The
browser says where a request comes from, so the name that it was sent to must be a loopback name
(against DNS rebinding), and its origin, where there is one, must be the page itself. Those who come
over the network must know a token instead; they get it in a link and keep it as a cookie.
"""

from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs

from starlette.datastructures import Headers
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from rig.web.access import Access, is_local, is_own, same_page

COOKIE = "touchplate"
CONTROLS = "touchplate.controls"  # key of the scope that says whether a request may act
PROTECTION = [
    (b"content-security-policy", b"default-src 'self'; img-src 'self' data:; "
     b"frame-ancestors 'none'; base-uri 'none'; form-action 'none'"),
    (b"x-content-type-options", b"nosniff"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"referrer-policy", b"no-referrer"),
    (b"cache-control", b"no-cache"),
]  # fmt: skip
REFUSAL = (
    "this page answers on its loopback address, http://127.0.0.1, and over the network only by the"
    " link that the run has printed\n"
)


class Guard:
    """ASGI layer that answers 403 to others and adds the protecting headers."""

    def __init__(self, app: ASGIApp, access: Access | None = None):
        self.app = app
        self._access = access or Access()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on requests of those who may look; refuse the others, websockets unaccepted."""
        if scope["type"] == "lifespan":
            return await self.app(scope, receive, send)
        headers = Headers(scope=scope)
        host, origin = headers.get("host", ""), headers.get("origin")
        peer = (scope.get("client") or ("", 0))[0]
        if is_local(peer) and is_own(host, origin):
            scope[CONTROLS] = True
            return await self.app(scope, receive, _protecting(send, None))
        linked = _from_link(scope)
        if same_page(host, origin) and self._access.knows(linked or _from_cookie(headers)):
            scope[CONTROLS] = self._access.control
            return await self.app(scope, receive, _protecting(send, linked))
        if scope["type"] == "websocket":
            return await send({"type": "websocket.close", "code": 1008})
        return await PlainTextResponse(REFUSAL, 403)(scope, receive, send)


def _from_link(scope: Scope) -> str:
    query = parse_qs(scope.get("query_string", b"").decode("latin-1"))
    return query.get("token", [""])[0]


def _from_cookie(headers: Headers) -> str:
    try:
        morsel = SimpleCookie(headers.get("cookie", "")).get(COOKIE)
    except CookieError:
        return ""
    return morsel.value if morsel else ""


def _protecting(send: Send, token: str | None) -> Send:
    """Add the protecting headers, and the token as a cookie to whoever came with it in a link."""
    added = list(PROTECTION)
    if token:
        cookie = f"{COOKIE}={token}; HttpOnly; SameSite=Strict; Path=/"
        added.append((b"set-cookie", cookie.encode("latin-1")))

    async def protected(message: Message) -> None:
        if message["type"] == "http.response.start":
            message["headers"] = [*message.get("headers", []), *added]
        await send(message)

    return protected

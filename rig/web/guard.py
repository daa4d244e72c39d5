"""Keep the page to those who may see it: every other request is refused.

A server on a loopback address is still within reach of any web site that the user has open. The
browser says where a request comes from, so the name that it was sent to must be a loopback name
(against DNS rebinding), and its origin, where there is one, must be the page itself. Those who come
over the network must know a token instead, and so must those on a machine with other users; they
get it in a link, which is answered by the address without it and a cookie. Cookies know no ports,
so its name has that of the server: two benches on a machine do not lock each other's viewers out.
"""

from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs

from starlette.datastructures import Headers
from starlette.responses import PlainTextResponse, RedirectResponse, Response
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
    "this page answers on its loopback address, http://127.0.0.1, and over the network, or where"
    " this machine has other users, only by the link that the run has printed\n"
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
        own = is_local(peer) and is_own(host, origin)
        linked, cookie = _from_link(scope), cookie_name(scope)
        known = self._access.knows(linked or _from_cookie(headers, cookie))
        if own and (known or self._access.alone):
            scope[CONTROLS] = True
        elif same_page(host, origin) and known:
            scope[CONTROLS] = self._access.control
        else:
            return await _refuse(scope, receive, send)
        if known and linked and scope["type"] == "http" and scope["method"] == "GET":
            return await _without_token(scope, cookie, linked)(scope, receive, _protecting(send))
        return await self.app(scope, receive, _protecting(send))


def cookie_name(scope: Scope) -> str:
    """Name of the cookie of the server that a request has come to."""
    return f"{COOKIE}-{(scope.get('server') or ('', 0))[1]}"


def _without_token(scope: Scope, cookie: str, token: str) -> Response:
    """Send a visitor to the same page by an address without the token, which a cookie keeps.

    A cookie that is `Strict` would not be sent there if the link was followed from another site;
    a `Lax` one is kept from all that other sites do but follow links.
    """
    moved = RedirectResponse(scope["path"], 303)
    moved.set_cookie(cookie, token, httponly=True, samesite="lax")
    return moved


async def _refuse(scope: Scope, receive: Receive, send: Send) -> None:
    if scope["type"] == "websocket":
        return await send({"type": "websocket.close", "code": 1008})
    return await PlainTextResponse(REFUSAL, 403)(scope, receive, send)


def _from_link(scope: Scope) -> str:
    query = parse_qs(scope.get("query_string", b"").decode("latin-1"))
    return query.get("token", [""])[0]


def _from_cookie(headers: Headers, name: str) -> str:
    try:
        morsel = SimpleCookie(headers.get("cookie", "")).get(name)
    except CookieError:
        return ""
    return morsel.value if morsel else ""


def _protecting(send: Send) -> Send:
    """Add the protecting headers."""

    async def protected(message: Message) -> None:
        if message["type"] == "http.response.start":
            message["headers"] = [*message.get("headers", []), *PROTECTION]
        await send(message)

    return protected

"""Serve the page of a test: images and fields as they are asked for, on the loopback address.

The page draws; whatever is measured is computed here, by the functions that the commands use.
"""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager
from functools import wraps
from pathlib import Path

from pydantic import ValidationError
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles

from rig.view.answers import GETS, POSTS, Answer
from rig.view.asked import first_sentence
from rig.view.viewed import ViewedTest
from rig.web.access import Access
from rig.web.guard import CONTROLS, Guard
from rig.web.limits import PatientRequests
from rig.web.serving import HOST, listen, serving

STATIC = Path(__file__).parent / "static"
SHARED = Path(__file__).parents[1] / "page" / "static"
"""Style of the operator page, which this one has too."""

LONGEST = 1 << 18  # bytes of what a page may ask for


@contextmanager
def serve(test: ViewedTest, port: int = 0, access: Access | None = None) -> Generator[str]:
    """Serve the page of a test while the block runs; yields its address.

    Parameters
    ----------
    test : ViewedTest
    port : int
        Port on 127.0.0.1; 0 takes a free one.
    access : Access or None
        Who may come in; None is everyone on this machine.

    Raises
    ------
    ValueError
        If the port is outside 0..65535.
    OSError
        If the port cannot be had.
    """
    access = access or Access()
    with listen(port, "port", option="--port") as listener:
        query = "" if access.alone else f"?token={access.token}"
        address = f"http://{HOST}:{listener.getsockname()[1]}/{query}"
        with serving(application(test, access), listener, "view", PatientRequests):
            yield address


def application(test: ViewedTest, access: Access) -> Starlette:
    """Return what answers the requests of the page of a test."""
    routes = [
        *(_route(test, path, answer, "GET") for path, answer in GETS.items()),
        *(_route(test, path, answer, "POST") for path, answer in POSTS.items()),
        Mount("/shared", StaticFiles(directory=SHARED)),
        Mount("/", StaticFiles(directory=STATIC, html=True)),
    ]
    return Starlette(routes=routes, middleware=[Middleware(Guard, access=access)])


def _route(test: ViewedTest, path: str, answer: Answer, method: str) -> Route:
    """Answer requests in a thread; what a user can correct is a sentence with status 400."""

    @wraps(answer)
    async def endpoint(request: Request) -> Response:
        if method == "POST" and not request.scope.get(CONTROLS):
            return PlainTextResponse("this page may look and not act\n", 403)
        body = await _body(request)
        if body is None:
            return PlainTextResponse(f"a wish has {LONGEST} bytes at the utmost\n", 413)
        try:
            return await run_in_threadpool(answer, test, request, body)
        except ValidationError as error:
            return PlainTextResponse(first_sentence(error), 400)
        except (ValueError, OSError) as error:
            return PlainTextResponse(" ".join(str(error).split()), 400)

    return Route(path, endpoint, methods=[method])


async def _body(request: Request) -> bytes | None:
    body = bytearray()
    async for part in request.stream():
        body += part
        if len(body) > LONGEST:
            return None
    return bytes(body)

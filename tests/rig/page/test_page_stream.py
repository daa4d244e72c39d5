"""The page's server: newest frame to whoever asks, nothing to foreigners, no burden to the loop."""

import json
import os
import socket
import subprocess
import sys
import threading
import time
from contextlib import ExitStack
from itertools import count
from types import SimpleNamespace

import cv2
import httpx
import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from rig.calibration.guide import Progress
from rig.calibration.store import Calibration
from rig.page import serve
from rig.page.controls import PageControls, Recording, Wizard
from rig.page.operator import Operator
from rig.projector.markers import fit_plate
from rig.recording.control import Switch
from rig.web import limits
from rig.web.access import Access, has_other_users, is_own

SCREEN = fit_plate((320, 200), (254.0, 200.0))


def stream(publisher, **options):
    return connect(f"ws://127.0.0.1:{publisher.port}/stream", max_size=None, **options)


def ask(client, wanted="camera strain projector"):
    client.send(wanted)
    header = json.loads(client.recv(timeout=10))
    return header, {name: client.recv(timeout=10) for name in header["parts"]}


def decoded(jpeg):
    return cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_UNCHANGED)


def test_a_page_gets_the_numbers_the_image_and_the_strain_of_a_frame(snapshot):
    shot = snapshot(7)
    with serve(0, SCREEN) as publisher, stream(publisher) as client:
        publisher.publish(shot)
        header, parts = ask(client)
    assert header["sequence"] == 7
    assert header["status"] == "two touches"
    assert [mark["force"] for mark in header["touches"]] == [mark.force for mark in shot.touches]
    assert header["size"] == [640, 520]
    seen = decoded(parts["camera"])
    assert seen.shape == shot.image.shape
    assert np.abs(seen.astype(float) - shot.image).mean() < 5  # grey levels of JPEG
    assert decoded(parts["projector"]).shape == (200, 320, 3)
    maps = np.frombuffer(parts["strain"], "<f4").reshape(3, *header["strain"]["shape"])
    np.testing.assert_array_equal(maps, [shot.strain.exx, shot.strain.eyy, shot.strain.exy])


def test_only_wanted_parts_that_exist_are_sent(snapshot):
    with serve(0) as publisher, stream(publisher) as client:
        publisher.publish(snapshot(1, with_strain=False))
        header, parts = ask(client)
        assert list(parts) == ["camera"]
        assert header["strain"] is None
        assert header["strain_reason"] == "the scene asks for no strain"
        assert header["projector"] is None
        publisher.publish(snapshot(2))
        assert ask(client, "")[1] == {}


@pytest.mark.parametrize(
    ("asked", "shape"),
    [
        ("camera:300", (312, 384)),  # whole steps of 128 px
        ("camera:384", (312, 384)),
        ("camera:0", (1, 1)),
        ("camera:9000", (520, 640)),
        ("camera:-5", (520, 640)),
        ("camera:wide", (520, 640)),
    ],
)
def test_a_page_gets_its_image_no_smaller_than_it_shows_it(snapshot, asked, shape):
    with serve(0) as publisher, stream(publisher) as client:
        publisher.publish(snapshot(1))
        _, parts = ask(client, asked)
    assert decoded(parts["camera"]).shape == shape


def test_what_is_not_a_number_is_null(snapshot):
    with serve(0) as publisher, stream(publisher) as client:
        publisher.publish(snapshot(1, latency=(np.nan, np.inf), noise=np.float32(np.nan)))
        header, _ = ask(client)
    assert header["latency"] == [None, None]
    assert header["noise"] is None


def test_a_page_gets_the_newest_frame_and_none_twice(snapshot):
    with serve(0) as publisher, stream(publisher) as client:
        for sequence in range(5):
            publisher.publish(snapshot(sequence, with_strain=False))
        assert ask(client)[0]["sequence"] == 4
        client.send("camera")
        with pytest.raises(TimeoutError):
            client.recv(timeout=0.2)
        publisher.publish(snapshot(5, with_strain=False))
        assert json.loads(client.recv(timeout=10))["sequence"] == 5


def test_a_page_that_never_reads_does_not_hold_the_loop(snapshot):
    shots = [snapshot(i) for i in range(2)]
    with ExitStack() as clients, serve(0) as publisher:
        slow = clients.enter_context(stream(publisher, max_queue=1, close_timeout=0.1))
        for _ in range(50):
            slow.send("camera strain")
        for i in range(3000):
            publisher.publish(shots[i % 2])
        with stream(publisher) as second:
            assert ask(second)[0]["sequence"] == 1


def test_an_open_page_counts_as_watcher_until_it_goes(snapshot):
    with serve(0) as publisher:
        with stream(publisher) as client:
            publisher.publish(snapshot(1))
            ask(client)
            assert publisher.watchers == 1
        end = time.monotonic() + 10
        while publisher.watchers and time.monotonic() < end:
            time.sleep(0.01)
        assert publisher.watchers == 0


@pytest.mark.parametrize(
    ("host", "origin"),
    [
        ("evil.example", None),
        ("127.0.0.1.evil.example", None),
        ("127.0.0.1:{port}", "http://evil.example"),
        ("127.0.0.1:{port}", "http://127.0.0.1:1"),
        ("127.0.0.1:{port}", "null"),
        ("localhost:{port}", "https://localhost:{port}"),
    ],
)
def test_a_foreign_name_or_origin_is_refused(host, origin):
    with serve(0) as publisher:
        headers = {"Host": host.format(port=publisher.port)}
        if origin:
            headers["Origin"] = origin.format(port=publisher.port)
        assert httpx.get(publisher.url, headers=headers).status_code == 403
        with socket.create_connection(("127.0.0.1", publisher.port)) as raw:
            lines = [f"{name}: {value}" for name, value in headers.items()]
            upgrade = "GET /stream HTTP/1.1\r\n" + "\r\n".join(lines) + (
                "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13"
                "\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"
            )  # fmt: skip
            raw.sendall(upgrade.encode())
            assert raw.recv(64).startswith(b"HTTP/1.1 403")


def test_our_own_page_may_stream(snapshot):
    with serve(0) as publisher:
        publisher.publish(snapshot(1))
        with stream(publisher, origin=publisher.url.rstrip("/")) as client:
            assert ask(client)[0]["sequence"] == 1
        with pytest.raises(InvalidStatus, match="403"):
            stream(publisher, origin="http://evil.example")


@pytest.mark.parametrize("host", ["", "[::1", "127.0.0.1@evil.example", "127.0.0.2"])
def test_a_strange_host_is_not_ours(host):
    assert not is_own(host, None)


def test_a_page_seen_through_a_forwarded_port_is_ours():
    assert is_own("localhost:9000", "http://localhost:9000")
    assert is_own("[::1]:9000", None)


def test_the_files_of_the_page_are_served_and_nothing_else():
    with serve(0) as publisher, httpx.Client(base_url=publisher.url) as client:
        answer = client.get("/")
        assert "<title>touchplate</title>" in answer.text
        assert "default-src 'self'" in answer.headers["content-security-policy"]
        assert client.get("/app.js").headers["content-type"].startswith("text/javascript")
        assert client.get("/../server.py").status_code == 404
        assert client.get("/%2e%2e/server.py").status_code == 404


def test_only_the_loopback_address_listens():
    with serve(0) as publisher, socket.socket() as other:
        other.bind(("127.0.0.2", publisher.port))  # would fail if the port were open everywhere


def test_a_port_in_use_is_one_sentence_before_anything_starts():
    threads = threading.active_count()
    with serve(0) as publisher:
        port = publisher.port
        with pytest.raises(OSError, match="in use") as caught, serve(port):
            pass
        assert str(caught.value) == (
            f"port {port} on 127.0.0.1 is in use; choose another with "
            f"--set page.port={port + 1 if port < 65535 else 8765} or stop the other program"
        )
    assert threading.active_count() == threads


def test_a_port_out_of_range_is_refused():
    with (
        pytest.raises(ValueError, match=r"page port must lie in 0\.\.65535, got 70000"),
        serve(70000),
    ):
        pass


def test_the_end_frees_port_and_thread_even_with_a_page_waiting(snapshot):
    threads = set(threading.enumerate())
    with ExitStack() as clients:
        with serve(0) as publisher:
            port = publisher.port
            client = clients.enter_context(stream(publisher))
            publisher.publish(snapshot(1))
            ask(client)
            client.send("camera")
        with pytest.raises(ConnectionClosed):
            client.recv(timeout=10)
    assert not [t for t in threading.enumerate() if t not in threads and t.name == "page"]
    with serve(port):
        pass


def test_an_error_in_the_loop_ends_the_server_and_comes_through():
    with pytest.raises(KeyboardInterrupt), serve(0) as publisher:
        raise KeyboardInterrupt
    with pytest.raises(httpx.ConnectError):
        httpx.get(publisher.url)


@pytest.mark.slow
def test_the_page_needs_no_torch():
    code = "import sys, rig.page; sys.exit('torch' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_the_snapshot_needs_no_web_server():
    code = "import sys, rig.live.snapshot, rig.projector; sys.exit('starlette' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


TOKEN = "of-the-link"


def test_what_is_asked_for_waits_for_the_loop(snapshot):
    with serve(0) as publisher:
        for wish in ({"do": "record"}, {"do": "drop", "view": 3}):
            answer = httpx.post(f"{publisher.url}ask", json=wish)
            assert answer.status_code == 204
        assert list(publisher.asked()) == [{"do": "record"}, {"do": "drop", "view": 3}]
        assert list(publisher.asked()) == []
        for number in range(100):
            publisher.ask({"do": str(number)})
        assert next(publisher.asked())["do"] == "68"


@pytest.mark.parametrize(
    ("content", "status"),
    [(b"{", 400), (b"[1]", 400), (b'{"do": 1}', 400), (b"x" * 600, 413), (b"", 400)],
)
def test_a_wish_that_is_none_is_refused(content, status):
    with serve(0) as publisher:
        assert httpx.post(f"{publisher.url}ask", content=content).status_code == status
        assert list(publisher.asked()) == []


def test_a_number_beyond_all_others_is_infinite_and_ends_no_loop():
    with serve(0) as publisher:
        for digits in ("1" + 400 * "0", "-1" + 400 * "0"):
            wish = f'{{"do": "weigh", "force": {digits}}}'
            assert httpx.post(f"{publisher.url}ask", content=wish).status_code == 204
        assert [wish["force"] for wish in publisher.asked()] == [np.inf, -np.inf]


def test_a_wish_that_nobody_fulfils_is_refused_with_those_that_are():
    with serve(0) as publisher:
        Operator(publisher, Switch(lambda file: None, None), Calibration(), ())
        answer = httpx.post(f"{publisher.url}ask", json={"do": "format"})
        assert answer.status_code == 400
        assert answer.text.startswith(
            "nothing here does 'format'; ask for one of record, set, tare"
        )
        assert list(publisher.asked()) == []
        assert httpx.post(f"{publisher.url}ask", json={"do": "tare"}).status_code == 204


def test_a_foreign_page_asks_for_nothing():
    with serve(0) as publisher:
        headers = {"Origin": "http://evil.example"}
        answer = httpx.post(f"{publisher.url}ask", json={"do": "record"}, headers=headers)
        assert answer.status_code == 403
        assert list(publisher.asked()) == []


def test_a_link_with_the_token_opens_the_page_and_leaves_a_cookie():
    host = {"Host": "bench:9"}
    with serve(0, access=Access(TOKEN)) as publisher, httpx.Client() as client:
        assert client.get(publisher.url, headers=host).status_code == 403
        assert client.get(f"{publisher.url}?token=wrong", headers=host).status_code == 403
        answer = client.get(f"{publisher.url}?token={TOKEN}", headers=host)
        assert (answer.status_code, answer.headers["location"]) == (303, "/")
        assert "httponly; path=/; samesite=lax" in answer.headers["set-cookie"].lower()
        assert f"touchplate-{publisher.port}={TOKEN};" in answer.headers["set-cookie"]
        cookie = host | {"Cookie": f"touchplate-{publisher.port}={TOKEN}"}
        assert client.get(f"{publisher.url}app.js", headers=cookie).status_code == 200
        foreign = cookie | {"Origin": "http://evil.example"}
        assert client.get(f"{publisher.url}app.js", headers=foreign).status_code == 403


@pytest.mark.parametrize("control", [False, True])
def test_who_comes_by_a_link_looks_and_acts_only_if_the_scene_says_so(snapshot, control):
    with serve(0, access=Access(TOKEN, control)) as publisher:
        cookie = {"Host": "bench:9", "Cookie": f"touchplate-{publisher.port}={TOKEN}"}
        publisher.publish(snapshot(1))
        plug = socket.create_connection(("127.0.0.1", publisher.port))
        keeps = {"Cookie": cookie["Cookie"]}
        with connect("ws://bench:9/stream", sock=plug, additional_headers=keeps) as client:
            assert ask(client)[0]["controls"] is control
        answer = httpx.post(f"{publisher.url}ask", json={"do": "record"}, headers=cookie)
        assert answer.status_code == (204 if control else 403)
        assert TOKEN in publisher.link


def test_this_machine_may_act(snapshot):
    with serve(0) as publisher, stream(publisher) as client:
        publisher.publish(snapshot(1))
        assert ask(client)[0]["controls"] is True
        assert publisher.link is None


def test_notes_settings_and_wizard_go_with_the_frame(snapshot):
    wizard = Wizard("camera", Progress("hold still", 3, 10, 0.08, ((0, "80 corners"),)), "mm")
    page_controls = PageControls(("a note",), Recording(True, "recording", 7, 0), (), (), wizard)
    with serve(0) as publisher, stream(publisher) as client:
        publisher.publish(snapshot(1), page_controls)
        header, _ = ask(client)
    assert header["notes"] == ["a note"]
    assert header["recording"]["frames"] == 7
    assert header["wizard"]["progress"]["views"] == [[0, "80 corners"]]


def test_two_benches_on_a_machine_keep_their_own_cookies():
    host = {"Host": "bench:9"}
    with (
        serve(0, access=Access("of-one")) as one,
        serve(0, access=Access("of-two")) as two,
        httpx.Client(headers=host) as client,
    ):
        for publisher, token in ((one, "of-one"), (two, "of-two")):
            moved = client.get(f"{publisher.url}?token={token}")
            name, _, value = moved.headers["set-cookie"].partition(";")[0].partition("=")
            client.cookies.set(name, value)
        assert [client.get(p.url).status_code for p in (one, two)] == [200, 200]


def test_a_machine_with_other_users_wants_the_token_on_loopback_too():
    access = Access(TOKEN, network=False, alone=False)
    with serve(0, access=access) as publisher, socket.socket() as other:
        other.bind(("127.0.0.2", publisher.port))  # the port is not open everywhere
        assert publisher.link is None
        bare = f"http://127.0.0.1:{publisher.port}/"
        assert publisher.url == f"{bare}?token={TOKEN}"
        assert httpx.get(bare).status_code == 403
        with httpx.Client(follow_redirects=True) as client:
            assert client.get(publisher.url).url == bare
            assert client.post(f"{bare}ask", json={"do": "record"}).status_code == 204
        assert httpx.post(f"{bare}ask", json={"do": "record"}).status_code == 403
        with pytest.raises(InvalidStatus, match="403"):
            stream(publisher)


@pytest.mark.parametrize(
    ("people", "others"),
    [
        ([(0, "/bin/bash"), (1, "/usr/sbin/nologin"), (65534, "/usr/sbin/nologin")], False),
        ([(0, "/bin/bash"), (1000, "/bin/bash")], False),
        ([(1000, "/bin/bash"), (1001, "/usr/sbin/nologin")], False),
        ([(1000, "/bin/bash"), (1001, "/bin/sh")], True),
    ],
)
def test_other_users_are_people_with_a_shell(people, others, monkeypatch):
    import pwd

    entries = [SimpleNamespace(pw_uid=uid, pw_shell=shell) for uid, shell in people]
    monkeypatch.setattr(pwd, "getpwall", lambda: entries)
    monkeypatch.setattr(os, "getuid", lambda: 1000)
    assert has_other_users() is others


def closed(connection):
    """Whether the other end has closed a connection."""
    connection.settimeout(20)
    try:
        return not connection.recv(1)
    except ConnectionResetError:
        return True


def test_idle_connections_make_room_for_a_page(snapshot, monkeypatch):
    monkeypatch.setattr(limits, "request_limit", lambda: 40)
    with serve(0) as publisher, ExitStack() as idle:
        publisher.publish(snapshot(1))
        address = "127.0.0.1", publisher.port
        first, *_ = [idle.enter_context(socket.create_connection(address)) for _ in range(60)]
        with stream(publisher) as client:
            assert ask(client)[0]["sequence"] == 1
        assert closed(first)


def test_a_request_that_is_never_over_is_cut_off(monkeypatch):
    monkeypatch.setattr(limits, "PATIENCE", 0.3)
    with serve(0) as publisher:
        with socket.create_connection(("127.0.0.1", publisher.port)) as slow:
            slow.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n")
            assert closed(slow)
        assert httpx.get(publisher.url).status_code == 200


def test_a_reader_that_never_reads_is_cut_off(snapshot, monkeypatch):
    monkeypatch.setattr(limits, "PATIENCE", 0.3)
    shots = [snapshot(i) for i in range(2)]
    with serve(0) as publisher, stream(publisher, max_queue=1, close_timeout=0.1) as lazy:
        end = time.monotonic() + 60
        for number in count():
            publisher.publish(shots[number % 2])
            try:
                lazy.send("camera strain")
            except ConnectionClosed:
                break
            assert time.monotonic() < end
            time.sleep(0.005)
        with stream(publisher) as client:
            assert ask(client)[0]["sequence"] in (0, 1)


def test_more_pages_than_there_is_room_for_put_out_the_longest_silent(snapshot, monkeypatch):
    monkeypatch.setattr(limits, "PAGES", 3)
    with serve(0) as publisher, ExitStack() as open_pages:
        publisher.publish(snapshot(1))
        pages = [open_pages.enter_context(stream(publisher)) for _ in range(3)]
        for page in pages:
            ask(page)
        publisher.publish(snapshot(2))
        ask(pages[0])
        with stream(publisher) as newest:
            ask(newest)
            with pytest.raises(ConnectionClosed):
                pages[1].recv(timeout=20)
        publisher.publish(snapshot(3))
        assert ask(pages[0])[0]["sequence"] == 3

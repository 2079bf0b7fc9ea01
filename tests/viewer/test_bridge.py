"""The whole click path without a browser: page, websocket, order of clicks, replay, refusals."""

import asyncio
import contextlib
import os
import socket as sockets
import threading
from pathlib import Path

import httpx
import numpy as np
import pytest
import websockets
from viser import _messages

from app.viewer import hub as hub_module
from app.viewer.hub import Hub
from tests.viewer.fakes import CAMERA, FakeWorkflow, Served, click, connect, eventually, messages_in, receive, until


def node(message: dict) -> str:
    return message.get("name", "")


async def looking(socket: websockets.ClientConnection, served: Served, clients: int = 1) -> None:
    """Say where the camera is, as a browser does; only then viser counts us."""
    await socket.send(CAMERA)
    view = served.hub._views["s1"]
    await eventually(lambda: len(view.server.get_clients()) >= clients)


def test_burst_of_clicks_keeps_its_order(served: Served, workflow: FakeWorkflow) -> None:
    """Fifty clicks at once on twelve regions: all arrive in order, repeated ones are refused by the workflow and nothing stops."""
    wanted = np.random.default_rng(3).integers(0, 12, 50).tolist()

    async def main() -> None:
        async with connect(served.base) as socket:
            await looking(socket, served)
            for region in wanted:
                await socket.send(click(region))
            await eventually(lambda: len(workflow.picked) == 50)

    asyncio.run(main())
    assert [region for _, region in workflow.picked] == wanted
    assert workflow.draft == list(dict.fromkeys(wanted))


def test_a_new_connection_sees_what_was_clicked_before(served: Served, workflow: FakeWorkflow) -> None:
    async def main() -> list[dict]:
        async with connect(served.base) as socket:
            await looking(socket, served)
            for region in (4, 7):
                await socket.send(click(region))
            await eventually(lambda: workflow.draft == [4, 7])
        view = served.hub._views["s1"]
        await eventually(lambda: view.stage.shown is not None and view.stage.shown.regions[7].text == "2")
        async with connect(served.base) as again:
            await again.send(CAMERA)
            return await receive(again, lambda got: any(node(m) == "/outlines/line" for m in got))

    messages = asyncio.run(main())
    meshes = [node(m) for m in messages if m["type"] == "MeshMessage"]
    assert sorted(meshes) == ["/tool/body", *(f"/tool/r{k:03d}" for k in range(12))]
    # labels replay as they were made plus the latest value of each property
    updates = {node(m): m["updates"]["text"] for m in messages if m["type"] == "SceneNodeUpdateMessage" and "text" in m["updates"]}
    assert (updates["/plates/r004"], updates["/plates/r007"], updates["/letters/r000"]) == ("1", "2", "A")


def test_a_dropped_browser_comes_back(served: Served, workflow: FakeWorkflow) -> None:
    async def main() -> None:
        async with connect(served.base) as socket:
            await looking(socket, served)
            served.hub._views["s1"].server._websock_server.disconnect_all_clients()
            await socket.wait_closed()
            assert socket.close_code == 1012
        async with connect(served.base) as again:
            await looking(again, served)
            await again.send(click(5))
            await eventually(lambda: workflow.draft == [5])

    asyncio.run(main())


def test_refusal_of_a_click_is_shown_to_the_person(served: Served, workflow: FakeWorkflow) -> None:
    async def main() -> list[dict]:
        async with connect(served.base) as socket:
            await looking(socket, served)
            await socket.send(click(3))
            await socket.send(click(3))
            return await receive(socket, lambda got: any("Notification" in m["type"] for m in got))

    notices = [m for m in asyncio.run(main()) if "Notification" in m["type"]]
    assert "already has its number" in str(notices[0])


async def refused(base: str, **how: object) -> int:
    try:
        async with connect(base, **how):  # type: ignore[arg-type]
            return 0
    except websockets.exceptions.InvalidStatus as error:
        return error.response.status_code


def test_strangers_are_refused(served: Served) -> None:
    async def main() -> dict[str, int]:
        return {
            "foreign origin": await refused(served.base, origin="http://evil.example"),
            "no origin": await refused(served.base, origin=None),
            "other port's origin": await refused(served.base, origin="http://127.0.0.1:1"),
            "no such session": await refused(served.base, sid="unknown"),
            "rebound name": await refused("http://evil.example", port=served.port),
        }

    assert asyncio.run(main()) == dict.fromkeys(
        ("foreign origin", "no origin", "other port's origin", "no such session", "rebound name"), 403
    )


def test_page_checks_name_parameters_and_session(served: Served) -> None:
    with httpx.Client(base_url=served.base) as browser:
        page = browser.get("/v/s1/?hideViserLogo&darkMode&fixedDpr=1")
        assert page.status_code == 200
        assert page.headers["content-encoding"] == "gzip"
        assert page.headers["cache-control"] == "no-cache"
        assert "connect-src 'self' data: blob:" in page.headers["content-security-policy"]
        assert "document.hasFocus" in page.text
        plain = browser.get("/v/s1/", headers={"Accept-Encoding": "identity"})
        assert plain.text == page.text
        assert browser.get("/v/s1/?websocket=ws://127.0.0.1:1").status_code == 400
        assert browser.get("/v/s1/?playbackPath=x").status_code == 400
        assert browser.get("/v/unknown/").status_code == 404
        assert browser.get("/v/s1/", headers={"Host": "evil.example"}).status_code == 421


def test_nothing_listens_beyond_this_machine(served: Served) -> None:
    with httpx.Client(base_url=served.base) as browser:
        assert browser.get("/v/s1/").status_code == 200
    addresses = listening()
    assert len(addresses) >= 2, "ours and the view's"
    assert addresses == ["127.0.0.1"] * len(addresses)


def listening() -> list[str]:
    """Addresses this process accepts connections on, from Linux's socket tables."""
    if not Path("/proc/net/tcp").exists():
        pytest.skip("reads the socket tables of Linux")
    ours = set()
    for path in Path("/proc/self/fd").iterdir():
        with contextlib.suppress(FileNotFoundError):  # closed meanwhile
            ours.add(os.readlink(path))
    found = []
    for table in ("tcp", "tcp6"):
        for line in Path(f"/proc/net/{table}").read_text().splitlines()[1:]:
            fields = line.split()
            if fields[3] == "0A" and f"socket:[{fields[9]}]" in ours:
                raw = bytes.fromhex(fields[1].split(":")[0])
                found.append(sockets.inet_ntop(sockets.AF_INET, raw[::-1]) if table == "tcp" else raw.hex())
    return found


def test_share_tunnel_cannot_be_asked_for(served: Served) -> None:
    """Guards the private names we use: this fails on the viser release that moves them."""
    httpx.get(f"{served.base}/v/s1/")
    import viser

    plain = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    handled = served.hub._views["s1"].server._websock_server._incoming_handlers
    try:
        for message in (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect):
            assert message in plain._websock_server._incoming_handlers
            assert message not in handled
        assert _messages.SceneNodeClickMessage in handled
    finally:
        plain.stop()


def test_views_are_put_away_when_nobody_looks(served: Served, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hub_module, "MOST_VIEWS", 2)
    with httpx.Client(base_url=served.base) as browser:
        for sid in ("s1", "s2", "s3"):
            assert browser.get(f"/v/{sid}/").status_code == 200
        assert set(served.hub._views) == {"s2", "s3"}
        served.hub._views["s2"].stops.add(asyncio.Event())  # somebody looks
        served.hub._views["s3"].stops.add(asyncio.Event())
        assert browser.get("/v/s4/").status_code == 503
        served.hub._views["s3"].stops.clear()
        now = served.hub._views["s3"].last_seen
        served.hub.reap(now + hub_module.IDLE_SECONDS - 1)
        assert set(served.hub._views) == {"s2", "s3"}
        served.hub.reap(now + hub_module.IDLE_SECONDS + 1)
        assert set(served.hub._views) == {"s2"}


def test_close_ends_threads_and_sockets(workflow: FakeWorkflow) -> None:
    from tests.viewer.fakes import serve

    served = serve(Hub(None, workflow.actions()))
    httpx.get(f"{served.base}/v/s1/")
    port = served.hub._views["s1"].port
    served.stop()
    assert not served.thread.is_alive()
    assert workflow.listeners == []
    with sockets.socket() as probe:
        assert probe.connect_ex(("127.0.0.1", port)) != 0
    until(lambda: not [t for t in threading.enumerate() if "view" in t.name])


def test_two_tabs_of_a_session_stay_in_step(served: Served, workflow: FakeWorkflow) -> None:
    async def main() -> dict:
        async with connect(served.base) as one, connect(served.base) as two:
            await looking(one, served)
            await looking(two, served, clients=2)
            await one.send(click(9))
            await eventually(lambda: workflow.draft == [9])
            got = await receive(two, lambda got: any(node(m) == "/outlines/line" for m in got))
            return {node(m): m["updates"] for m in got if m["type"] == "SceneNodeUpdateMessage"}

    assert asyncio.run(main())["/tool/r009"]["color"] == [68, 52, 147]


def test_frames_can_be_read() -> None:
    """The reading of frames used above, on a frame made by hand."""
    import msgspec
    import zstandard

    body = zstandard.ZstdCompressor().compress(msgspec.msgpack.encode({"messages": [{"type": "X"}]}))
    frame = (0).to_bytes(8, "little") + len(body).to_bytes(8, "little") + body + b"rest"
    assert messages_in(frame) == [{"type": "X"}]

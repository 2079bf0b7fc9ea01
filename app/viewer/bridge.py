"""Who may look: checks before a view is shown, and the pump between a browser's websocket and the view's own server."""

import asyncio
import contextlib
from collections.abc import Coroutine
from typing import Any
from urllib.parse import urlsplit

import websockets
from fastapi import WebSocket
from starlette.requests import HTTPConnection
from starlette.websockets import WebSocketDisconnect

LOOPBACK = frozenset({"127.0.0.1", "localhost", "::1"})
SERVER_LEFT = 1012  # the browser may try again
TOO_MANY = 1013


def host_is_local(connection: HTTPConnection) -> bool:
    """Whether the Host header names this machine; anything else is DNS rebinding or a misconfiguration."""
    try:
        return urlsplit(f"//{connection.headers.get('host', '')}").hostname in LOOPBACK
    except ValueError:
        return False


def origin_is_ours(connection: HTTPConnection) -> bool:
    """Whether the page that opens the websocket came from the address it connects to."""
    scheme = "https" if connection.url.scheme in ("https", "wss") else "http"
    return connection.headers.get("origin") == f"{scheme}://{connection.headers.get('host', '')}"


def viser_subprotocol(browser: WebSocket) -> str | None:
    """The protocol version the browser offers; it must be echoed or the browser drops the connection."""
    offered = browser.scope.get("subprotocols", [])
    return next((name for name in offered if name.startswith("viser-v")), None)


async def pump(browser: WebSocket, port: int, subprotocol: str, stop: asyncio.Event) -> None:
    """Carry bytes both ways until either side closes or `stop` is set."""
    address = f"ws://127.0.0.1:{port}"
    async with websockets.connect(address, subprotocols=[websockets.Subprotocol(subprotocol)], max_size=None, compression=None) as upstream:
        await browser.accept(subprotocol=subprotocol)

        async def to_viser() -> None:
            while True:
                await upstream.send(await browser.receive_bytes())

        async def to_browser() -> None:
            async for message in upstream:
                await browser.send_bytes(message if isinstance(message, bytes) else message.encode())

        await _first_of(to_viser(), to_browser(), stop.wait())
        code = 1002 if upstream.close_code == 1002 else SERVER_LEFT
    with contextlib.suppress(RuntimeError, WebSocketDisconnect):  # the browser may be the side that left
        await browser.close(code)


async def _first_of(*work: Coroutine[Any, Any, object]) -> None:
    """Run until one is through, then end the others."""
    tasks = [asyncio.create_task(part) for part in work]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

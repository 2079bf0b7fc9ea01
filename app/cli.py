"""The `apprentice` command. Heavy parts are imported by the command that needs them, so `--help` stays quick."""

import ipaddress
import json
import os
import shutil
import socket
import sqlite3
import sys
import tempfile
import threading
import time
import webbrowser
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from app.settings import Settings

if TYPE_CHECKING:
    from fastapi import FastAPI

app = typer.Typer(add_completion=False, no_args_is_help=True, pretty_exceptions_enable=False, help=__doc__)

Host = Annotated[str | None, typer.Option(help="Address to listen on; only this machine's own (loopback) is allowed.")]
Port = Annotated[int | None, typer.Option(min=0, max=65535, help="Port to listen on; 0 takes any free one.")]
Data = Annotated[Path | None, typer.Option(help="Folder of the database and the files beside it.")]

SAFE_SQLITE = (3, 51, 3)
PORTS_TRIED = 50
GRACE_S = 2


def main() -> None:
    """Entry point; errors people can cause are a sentence, not a traceback."""
    from app.errors import AppError

    try:
        app()
    except AppError as error:
        fail(str(error))


def fail(sentence: str) -> None:
    """Say what is wrong and leave with status 2."""
    typer.echo(sentence, err=True)
    raise SystemExit(2)


def chosen_settings(host: str | None = None, port: int | None = None, data: Path | None = None) -> Settings:
    """Settings from the environment, then the options."""
    given = {"host": host, "port": port, "data": data}
    return Settings(**{name: value for name, value in given.items() if value is not None})


@app.command()
def serve(host: Host = None, port: Port = None, data: Data = None) -> None:
    """Start the server and stay until it is stopped."""
    settings = chosen_settings(host, port, data)
    check_loopback(settings.host)
    listener = listen(settings.host, settings.port)
    if listener is None:
        fail(f"Port {settings.port} is in use. Stop what listens there or choose another one with --port.")
    else:
        run(settings, listener, announce=False)


@app.command()
def demo(
    port: Port = None, data: Data = None, browser: Annotated[bool, typer.Option(help="Open a browser where there is one.")] = True
) -> None:
    """Start with a sample project and open it."""
    settings = chosen_settings(None, port, data)
    check_loopback(settings.host)
    listener = first_free(settings.host, settings.port)
    run(settings, listener, announce=True, browser=browser)


@app.command()
def study(
    what: Annotated[
        Literal["synthetic", "real", "compare", "ablation", "coverage", "effort"],
        typer.Argument(help="One of the authors' sets, or: all learners side by side, Eq. 7 term by term, Table I, Fig. 5."),
    ],
    data: Annotated[Path, typer.Option(exists=True, file_okay=False, help="Folder with the authors' tables.")],
    out: Annotated[Path | None, typer.Option(file_okay=False, help="Folder for figures (JSON) and plots (SVG).")] = None,
    json_file: Annotated[Path | None, typer.Option("--json", help="synthetic, real: also write the figures to this file.")] = None,
    seeds: Annotated[int, typer.Option(min=2, help="ablation: runs of each variant.")] = 20,
    experts: Annotated[int, typer.Option(min=1, help="compare: made-up experts.")] = 30,
) -> None:
    """Run one of the paper's studies with a scripted expert and print it."""
    from app.benches import studies

    if what == "compare":
        studies.compare(data, out, typer.echo, experts)
    elif what == "ablation":
        studies.ablation(data, out, typer.echo, seeds)
    elif what == "coverage":
        studies.coverage(data, out, typer.echo)
    elif what == "effort":
        studies.effort(data, out, typer.echo)
    else:
        evaluation(what, data, out, json_file)


def evaluation(kind: Literal["synthetic", "real"], data: Path, out: Path | None, json_file: Path | None) -> None:
    """The paper's evaluation on one of the authors' sets."""
    from dataclasses import asdict

    from app.benches.report import evaluation_tables, save_report
    from app.learning.study import format_study, run_study

    report = run_study(kind, data)
    typer.echo(format_study(report))
    save_report(out, kind, f"The paper's evaluation on the authors' {kind} tools", data, evaluation_tables(report))
    for place in (json_file, out / f"{kind}.json" if out else None):
        if place is not None:
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_text(json.dumps(asdict(report), indent=2, default=plain) + "\n", encoding="utf-8")


def plain(value: object) -> object:
    """JSON form of what a report holds beyond plain values (arrays, paths)."""
    return value.tolist() if hasattr(value, "tolist") else str(value)  # pyright: ignore[reportAttributeAccessIssue]


@app.command()
def bench(
    name: Annotated[Literal["sequencing", "learning", "geometry"], typer.Argument(help="What to measure.")],
    data: Annotated[Path | None, typer.Option(exists=True, file_okay=False, help="Folder with the authors' tables.")] = None,
    cad: Annotated[Path | None, typer.Option(exists=True, file_okay=False, help="Folder with CAD files.")] = None,
    checkout: Annotated[
        Path | None,
        typer.Option("--authors", "--checkout", exists=True, file_okay=False, help="Checkout of the authors' code, for ratios."),
    ] = None,
    out: Annotated[Path | None, typer.Option(file_okay=False, help="Folder for pictures and tables.")] = None,
    json_file: Annotated[Path | None, typer.Option("--json", help="Also write the figures to this file.")] = None,
    quick: Annotated[bool, typer.Option(help="Smaller doses; bars may be missed.")] = False,
    reference_command: Annotated[str | None, typer.Option(help="Solves one tool in that checkout (docs/sequencing.md).")] = None,
    reference_tool: Annotated[str | None, typer.Option(help="Which of the tables in --data it solves: real/8, synthetic/9.")] = None,
) -> None:
    """Measure and print each figure beside its bar; status 1 when a bar is missed."""
    from importlib import import_module

    from app.benches.figures import Figure, Options, as_json, grouped

    seen: list[Figure] = []

    def kept() -> Iterator[Figure]:
        for figure in import_module(f"app.benches.{name}").measure(
            Options(data, cad, checkout, out, quick, reference_command, reference_tool)
        ):
            seen.append(figure)
            yield figure

    for line in grouped(kept()):
        typer.echo(line)
    if json_file is not None:
        json_file.write_text(json.dumps(as_json(seen), indent=2) + "\n", encoding="utf-8")
    missed = sum(figure.met is False for figure in seen)
    typer.echo(f"\n{sum(figure.met is True for figure in seen)} bars met, {missed} missed.")
    if missed:
        raise SystemExit(1)


@app.command()
def migrate(data: Data = None) -> None:
    """Bring the database to this version's tables."""
    from app.storage import migrate as migrate_database

    settings = chosen_settings(data=data)
    migrate_database(settings)
    typer.echo(f"{settings.database} is up to date.")


@app.command()
def doctor(data: Data = None) -> None:
    """Look for what could keep Apprentice from working."""
    settings = chosen_settings(data=data)
    findings = examine(settings)
    for good, sentence in findings:
        typer.echo(f"{'ok  ' if good else 'WARN'}  {sentence}")
    if not all(good for good, _ in findings):
        raise SystemExit(1)


def examine(settings: Settings) -> list[tuple[bool, str]]:
    """What `doctor` prints: (good, sentence)."""
    version = tuple(int(part) for part in sqlite3.sqlite_version.split("."))
    advice = "" if version >= SAFE_SQLITE else "; before 3.51.3 two writing processes can damage a database, so run one server only"
    settings.data.mkdir(parents=True, exist_ok=True)
    free_mb = shutil.disk_usage(settings.data).free // 1_000_000
    probe = listen(settings.host, settings.port)
    if probe is not None:
        probe.close()
    return [
        (sys.version_info >= (3, 11), f"Python {sys.version.split()[0]} (3.11 or newer is needed)"),
        (True, f"SQLite {sqlite3.sqlite_version}{advice}"),
        (os.access(settings.data, os.W_OK), f"data folder {settings.data} can be written"),
        (free_mb > 500, f"{free_mb} MB free on its disk"),
        (probe is not None, f"port {settings.port} is {'free' if probe is not None else 'in use; demo takes the next free one'}"),
    ]


@app.command()
def openapi() -> None:
    """Print the OpenAPI document."""
    from app.main import create_app

    with tempfile.TemporaryDirectory() as folder:
        application = create_app(Settings(data=Path(folder), executor="inline"))
        typer.echo(json.dumps(application.openapi(), indent=2))
        application.state.context.close()


def check_loopback(host: str) -> None:
    """Leave unless `host` is this machine only: there is no login yet."""
    try:
        loopback = host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        loopback = False
    if not loopback:
        fail(
            f"Apprentice has no login yet, so it listens on this machine only: {host} is refused, 127.0.0.1 is accepted. "
            "To use it from elsewhere, forward the port over ssh: ssh -L 8765:127.0.0.1:8765 thismachine"
        )


def listen(host: str, port: int) -> socket.socket | None:
    """A listening socket, or None when the port is taken."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((host, port))
        listener.listen(128)
    except OSError:
        listener.close()
        return None
    return listener


def first_free(host: str, port: int) -> socket.socket:
    """A socket on `port` or the next free one above it."""
    for candidate in range(port, min(port + PORTS_TRIED, 65536)):
        listener = listen(host, candidate)
        if listener is not None:
            return listener
    fail(f"No port from {port} to {port + PORTS_TRIED - 1} is free; choose another one with --port.")
    raise AssertionError("unreachable")


def run(settings: Settings, listener: socket.socket, *, announce: bool, browser: bool = False) -> None:
    """Serve on `listener` until stopped; `announce` makes the sample project first and says where it is."""
    from app.prepare import compile_once

    compile_once(typer.echo)
    typer.echo("Starting Apprentice ...")
    from app.main import create_app

    application = create_app(settings)
    port = listener.getsockname()[1]
    address = f"http://{'[::1]' if ':' in settings.host else settings.host}:{port}/"
    if announce:
        address += sample_page(application)
    threading.Thread(target=announce_start, args=(address, port, settings.host, browser), daemon=True).start()
    serve_until_stopped(application, listener)


def sample_page(application: "FastAPI") -> str:
    """Path of the sample project's first page; makes the project when there is none."""
    from app.workflow import projects

    context = application.state.context
    known = [project for project in projects.list_projects(context) if project["sample"]]
    sample = known[0] if known else projects.create_sample_project(context)
    return f"p/{sample['id']}/tools"


def announce_start(address: str, port: int, host: str, browser: bool) -> None:
    """Print the address once the server answers there, and open it."""
    while not answers(host, port):
        time.sleep(0.05)
    typer.echo(f"Apprentice is at {address} (stop it with Ctrl+C)")
    sys.stdout.flush()
    if browser and has_display():
        webbrowser.open(address)


def answers(host: str, port: int) -> bool:
    """Whether /healthz answers."""
    import http.client

    connection = http.client.HTTPConnection(host, port, timeout=5)
    try:
        connection.request("GET", "/healthz")
        return connection.getresponse().status == 200
    except OSError:
        return False
    finally:
        connection.close()


def has_display() -> bool:
    """Whether a browser could show a window here."""
    return sys.platform in ("darwin", "win32") or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def serve_until_stopped(application: "FastAPI", listener: socket.socket) -> None:
    """Run uvicorn on the one port; open event streams end first when it stops."""
    import uvicorn

    class Server(uvicorn.Server):
        async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
            application.state.streams.close()
            await super().shutdown(sockets)

    config = uvicorn.Config(
        application,
        log_level="warning",
        ws="websockets-sansio",
        ws_per_message_deflate=False,
        ws_max_size=50_000_000,
        timeout_graceful_shutdown=GRACE_S,
        workers=1,
        server_header=False,
    )
    try:
        Server(config).run([listener])
    except KeyboardInterrupt:
        typer.echo("Stopped.")


if __name__ == "__main__":
    main()

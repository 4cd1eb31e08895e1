"""The workbench as a local web server: for this machine alone, unless told otherwise, and then with a token."""

import importlib
import importlib.util
import ipaddress
import json
import logging
import os
import secrets
import socket
import threading
import webbrowser
from collections.abc import Awaitable, Callable, MutableMapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import click

from fitting.errors import InputError
from fitting.workbench.settings import WORKBENCH

ASKED = "MCKIBBEN_WORKBENCH"  # how the command line reaches the notebook: as JSON
Scope = MutableMapping[str, Any]
App = Callable[[Scope, Callable[[], Awaitable[Any]], Callable[[Any], Awaitable[None]]], Awaitable[None]]


def notebook() -> Path:
    """Where the workbench's notebook lies: inside the installed package, else beside its source."""
    installed = Path(str(resources.files("fitting"))) / "_notebooks" / "workbench.py"
    return installed if installed.is_file() else Path(__file__).resolve().parents[2] / "notebooks" / "workbench.py"


def data_folder(dataset: str) -> Path:
    """The folder that a name on the command line means: a path, else a shipped data set."""
    from fitting.shipped import example_data, example_names

    if Path(dataset).exists():
        return Path(dataset).resolve()
    if dataset in example_names():
        return example_data(dataset)
    cure = f"name a folder with muscle.toml, or one of {', '.join(example_names())}"
    raise InputError("no such file or folder", dataset, cure=cure)


def launch_options() -> dict[str, Any]:
    """What the command line asked for: `data`, a folder or nothing, and `candidates`."""
    return {"data": None, "candidates": []} | json.loads(os.environ.get(ASKED, "{}"))


def serve(
    dataset: str | None, port: int | None, host: str, token: str | None, candidates: Sequence[str], browse: bool = True
) -> None:
    """Serve the workbench until it is interrupted."""
    if importlib.util.find_spec("marimo") is None:
        raise InputError("the workbench needs marimo", cure="pip install 'mckibben-jax[workbench]'")
    folder = str(data_folder(dataset)) if dataset else None
    os.environ[ASKED] = json.dumps({"data": folder, "candidates": list(candidates)})
    here = is_loopback(host)
    token = None if here else token or secrets.token_urlsafe(16)
    with listening(host, port) as open_socket:
        place = f"http://{_written(host)}:{open_socket.getsockname()[1]}/"
        address = place if token is None else f"{place}?access_token={token}"
        if not here:
            click.echo("Anyone who has this address with its token can see your data and compute on this machine.")
        click.echo(f"The workbench is at {address}")
        click.echo("Ctrl+C ends it.")
        threading.Thread(target=_warm, daemon=True).start()
        if browse:
            threading.Timer(1.0, webbrowser.open, (address,)).start()
        _run(application(token, host), open_socket)


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach the address."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _written(host: str) -> str:
    return f"[{host}]" if ":" in host else host


def listening(host: str, port: int | None) -> socket.socket:
    """A socket at the port asked for, else at the first free one."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    for number in [port] if port else range(WORKBENCH.port, WORKBENCH.port + WORKBENCH.next_ports):
        try:
            return socket.create_server((host, number), family=family)
        except OSError as error:
            problem = error
    cure = "name another --port" if port else "name a free one with --port"
    raise InputError(f"the port cannot be listened at: {problem.strerror}", value=f"{host}:{number}", cure=cure)


def application(token: str | None, host: str) -> App:
    """The workbench as an ASGI application; every visit is a session of its own."""
    import marimo

    marimo_app = marimo.create_asgi_app(quiet=True, token=token or "").with_app(path="", root=str(notebook())).build()
    return guarded(marimo_app, None if token else (host, "127.0.0.1", "localhost", "::1"))


def guarded(app: App, hosts: tuple[str, ...] | None) -> App:
    """Refuse what a page from elsewhere sends: another origin, or a name that only pretends to be this machine."""

    async def guard(scope: Scope, receive: Callable, send: Callable) -> None:
        if scope["type"] in ("http", "websocket") and not is_own(dict(scope["headers"]), hosts):
            if scope["type"] == "websocket":
                await send({"type": "websocket.close", "code": 1008})
                return
            await send({"type": "http.response.start", "status": 403, "headers": []})
            await send({"type": "http.response.body", "body": b"This is not the workbench's own address."})
            return
        await app(scope, receive, send)

    return guard


def is_own(headers: dict[bytes, bytes], hosts: tuple[str, ...] | None) -> bool:
    """Whether a request was meant for this server, and comes from its own page if it says where it comes from."""
    host, origin = headers.get(b"host", b"").decode("latin-1"), headers.get(b"origin")
    known = hosts is None or urlsplit(f"//{host}").hostname in hosts
    return known and (origin is None or urlsplit(origin.decode("latin-1")).netloc == host)


def _warm() -> None:
    """Load what a session needs while the browser opens: the first picture comes the sooner."""
    from fitting.compiled.prepare import prepare

    prepare()
    importlib.import_module("fitting.workbench.session")


def _run(app: App, open_socket: socket.socket) -> None:
    import uvicorn

    logging.getLogger("asyncio").setLevel(logging.ERROR)  # that a closed tab cannot be written to is no news
    config = uvicorn.Config(app, log_level="warning", ws="websockets-sansio", timeout_graceful_shutdown=1)
    uvicorn.Server(config).run(sockets=[open_socket])

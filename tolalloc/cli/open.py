"""The command ``tolalloc open``: the live page of a study."""

from __future__ import annotations

import webbrowser
from contextlib import suppress
from typing import TYPE_CHECKING, Annotated

import typer

from tolalloc.cli.console import announce_kernel, note
from tolalloc.cli.run import Script
from tolalloc.exceptions import InputError
from tolalloc.study.script import load_study

if TYPE_CHECKING:
    from tolalloc.cli.live.desk import Desk
    from tolalloc.cli.live.server import Address, LiveServer


def open_page(
    script: Script,
    port: Annotated[int, typer.Option(help="Port of this machine; a free one unless given.")] = 0,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")] = True,
) -> None:
    """Open the live page of a study: move a zone, see cost, curve and yield of the real model."""
    from tolalloc.cli.live.desk import Desk
    from tolalloc.cli.live.server import Address
    from tolalloc.cli.live.session import Session
    from tolalloc.study.prepared import Prepared

    study = load_study(script)
    session = Session(prepared=Prepared(study=study))
    _ = session.prepared.requirements  # what is wrong with the study is said before a page opens
    announce_kernel(study.model)
    place = script.resolve()
    server = _server(Desk(session=session, script=place), Address.of(place), port)
    Address(port=server.http.server_port, token=server.token).keep(place)
    typer.echo(f"Open {server.address}")
    note("The page works on this machine only. Ctrl-C stops it.", dim=True)
    if browser:
        webbrowser.open(server.address)
    try:
        server.http.serve_forever()
    except KeyboardInterrupt:
        note("The page is closed. What you saved is in the folder of the study.")
    finally:
        server.desk.stop()
        server.http.server_close()


def _server(desk: Desk, last: Address, port: int) -> LiveServer:
    """Return the server at the port that is asked for, at that of last time, or where that is taken at a free one."""
    from tolalloc.cli.live.server import LiveServer

    if not port and last.port:
        with suppress(InputError):
            server = LiveServer(desk=desk, port=last.port, token=last.token)
            _ = server.http
            return server
    return LiveServer(desk=desk, port=port, token=last.token)

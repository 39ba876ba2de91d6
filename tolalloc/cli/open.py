"""The command ``tolalloc open``: the live page of a study."""

from __future__ import annotations

import webbrowser
from typing import Annotated

import typer

from tolalloc.cli.console import announce_compilation, note
from tolalloc.cli.run import Script
from tolalloc.cli.study_script import load_study


def open_page(
    script: Script,
    port: Annotated[int, typer.Option(help="Port of this machine; a free one unless given.")] = 0,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")] = True,
) -> None:
    """Open the live page of a study: move a zone, see cost, curve and yield of the real model."""
    from tolalloc.function_model import FunctionModel
    from tolalloc.live.desk import Desk
    from tolalloc.live.server import LiveServer
    from tolalloc.live.session import Session
    from tolalloc.study.prepared import Prepared

    study = load_study(script)
    session = Session(prepared=Prepared(study=study))
    _ = session.requirements  # what is wrong with the study is said before a page opens
    if not isinstance(study.model, FunctionModel):
        announce_compilation()
    server = LiveServer(desk=Desk(session=session, script=script.resolve()), port=port)
    typer.echo(f"Open {server.address}")
    note("The page is for this machine alone. Ctrl-C ends it.", dim=True)
    if browser:
        webbrowser.open(server.address)
    try:
        server.http.serve_forever()
    except KeyboardInterrupt:
        note("The page is closed. What you saved stands beside the study.")
    finally:
        server.desk.stop()
        server.http.server_close()

"""``panto app``: a page of one pass in the browser."""

from __future__ import annotations

import webbrowser
from typing import Annotated

from typer import Option

from ..base.extras import require
from ..terminal import console


def app(
    port: Annotated[
        int, Option(min=1024, max=65535, help="Port of this machine at which it is served.")
    ] = 5006,
    no_browser: Annotated[
        bool, Option("--no-browser", help="Only serve the page, and open no browser.")
    ] = False,
) -> None:
    """Serve a page on which line, pantograph, speed and policy are chosen and their run is seen at once.

    Only browsers of this machine reach it, and it needs no network. Ctrl+C ends it.
    """
    require("The page", "app", "bokeh")
    from ..app.page import serve

    def ready(address: str) -> None:
        console.print(f"The page is {address}; Ctrl+C ends it.", soft_wrap=True)
        if not no_browser:
            webbrowser.open(address)

    serve(port, ready)

"""ruedo docs: the documentation's site, served to a browser on this machine. Exit codes: 0 good,
2 wrong usage, 4 environment.
"""

from __future__ import annotations

import argparse
import functools
import webbrowser
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

from .launching import find_ruedo
from .terminal import tell

GOOD, ENVIRONMENT = 0, 4


class _Quiet(SimpleHTTPRequestHandler):
    def log_message(self, format: str, *args: object) -> None:
        pass


def site() -> Path | None:
    """The folder of the site, of an installation or a build; None where it has none."""
    prefix = Path(find_ruedo()).resolve().parents[1]
    for folder in (prefix / "share/doc/ruedo/site", prefix / "site"):
        if (folder / "index.html").is_file():
            return folder
    return None


def main(words: list[str]) -> int:
    text = "open the documentation in a browser"
    parser = argparse.ArgumentParser(prog="ruedo docs", description=text)
    parser.add_argument("--port", type=int, default=0, help="of 127.0.0.1 (default: a free one)")
    parser.add_argument("--no-browser", action="store_true", help="print the address only")
    parser.add_argument("--path", action="store_true", help="print the site's folder, and exit")
    given = parser.parse_args(words[1:])
    if not 0 <= given.port <= 65535:
        parser.error(f"--port {given.port}: a port is 0 to 65535")
    folder = site()
    if folder is None:
        tell(
            "ruedo: this installation has no documentation: pip install 'ruedo[docs]', "
            "or in a build folder: cmake --build . --target ruedo-site"
        )
        return ENVIRONMENT
    if given.path:
        print(folder)
        return GOOD
    return _serve(folder, given.port, not given.no_browser)


def _serve(folder: Path, port: int, show: bool) -> int:
    handler = functools.partial(_Quiet, directory=str(folder))
    try:
        server = ThreadingHTTPServer(("127.0.0.1", port), handler)
    except OSError as error:
        tell(f"ruedo: 127.0.0.1:{port}: {error.strerror}")
        return ENVIRONMENT
    with server:
        address = f"http://127.0.0.1:{server.server_port}/index.html"
        print(f"The documentation is at {address} (Ctrl C ends it)", flush=True)
        if show:
            webbrowser.open(address)
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            return GOOD
    return GOOD

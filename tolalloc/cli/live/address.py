"""Where the page of a study was last time: a page that is still open goes on when its server is started again."""

from __future__ import annotations

import json
import os
import re
import secrets
from dataclasses import dataclass
from pathlib import Path

_KEPT = ".tolalloc-live"
_TOKEN = re.compile(r"[A-Za-z0-9_-]{32}")


@dataclass(frozen=True, kw_only=True)
class Address:
    """Port and token of a page.

    Parameters
    ----------
    port
        Port of this machine; 0 for a free one [-].
    token
        What a request must know.
    """

    port: int = 0
    token: str

    @classmethod
    def of(cls, script: Path) -> Address:
        """Return where the page of a study was last time, or a new place."""
        new = cls(token=secrets.token_urlsafe(24))
        try:
            kept = json.loads((script.parent / _KEPT / f"{script.stem}.json").read_text(encoding="utf-8"))
            port, token = kept["port"], kept["token"]
        except (OSError, ValueError, TypeError, KeyError):
            return new
        known = type(port) is int and 0 < port < 2**16 and isinstance(token, str) and _TOKEN.fullmatch(token)
        return cls(port=port, token=token) if known else new

    def keep(self, script: Path) -> None:
        """Keep it beside the study, for its owner alone; where that cannot be written, the next page is a new one."""
        folder = script.parent / _KEPT
        try:
            folder.mkdir(mode=0o700, exist_ok=True)
            path = folder / f"{script.stem}.json"
            with open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "w", encoding="utf-8") as file:
                json.dump({"port": self.port, "token": self.token}, file)
        except OSError:
            return

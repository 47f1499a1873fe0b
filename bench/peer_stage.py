"""A stage as a peer among peers, without a router: for `link.py`, to compare with. Not a way to run Deixis.

usage: python bench/peer_stage.py STAGE LISTEN PEER,PEER,... [options of the stage]
"""

from __future__ import annotations

import importlib
import json
import sys

import zenoh
from deixis_runtime import session
from deixis_runtime.session import base_config


def peer_config(listen: str, peers: list[str]) -> zenoh.Config:
    """A peer that listens there and links to all the others, each of which it tries until it is there."""
    config = base_config("peer")
    settings = {
        "listen/endpoints": [listen],
        "connect/endpoints": [peer for peer in peers if peer and peer != listen],
        "connect/timeout_ms": -1,
        "connect/exit_on_failure": False,
        "connect/retry": {"period_init_ms": 500, "period_max_ms": 2000, "period_increase_factor": 2},
        "transport/link/tx/lease": 2000,
    }
    for path, value in settings.items():
        config.insert_json5(path, json.dumps(value))
    return config


def main() -> int:
    """Run the stage until told to stop."""
    stage, listen, peers, *arguments = sys.argv[1:]
    session.client_config = lambda *_, **__: peer_config(listen, peers.split(","))
    module = importlib.import_module(f"deixis_{stage}.service")
    return int(module.main(arguments))


if __name__ == "__main__":
    raise SystemExit(main())

"""Imports modules one after the other in this fresh process and tells what each adds. bench/memory.py starts it.

usage: python bench/import_steps.py STEP=MODULE[,MODULE...] ... > ANSWER

ANSWER: {STEP: {"private_mb": pages that this process alone holds, "ms": processor's time, "modules": how many were new}};
the step "python" is the interpreter before any.
"""

from __future__ import annotations

import importlib
import json
import sys
import time
from pathlib import Path


def private_mb() -> float:
    """Memory of this process that is in no file, MB: what no other process shares."""
    for line in Path("/proc/self/smaps_rollup").read_text(encoding="ascii").splitlines():
        if line.startswith("Anonymous:"):
            return int(line.split()[1]) / 1024
    raise RuntimeError("/proc/self/smaps_rollup says nothing of anonymous memory")


def main(steps: list[str]) -> int:
    before_mb, answer = private_mb(), {}
    answer["python"] = {"private_mb": before_mb, "ms": time.process_time() * 1000, "modules": len(sys.modules)}
    for step in steps:
        name, _, modules = step.partition("=")
        known, began_s = len(sys.modules), time.process_time()
        for module in modules.split(","):
            importlib.import_module(module)
        spent_ms = (time.process_time() - began_s) * 1000
        now_mb = private_mb()
        answer[name] = {"private_mb": now_mb - before_mb, "ms": spent_ms, "modules": len(sys.modules) - known}
        before_mb = now_mb
    json.dump(answer, sys.stdout)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

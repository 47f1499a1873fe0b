"""What makes data for fitting ends with the process that asked for them, also where that is killed hard."""

import subprocess
import sys
from pathlib import Path

import pytest

FITTING = Path(__file__).parents[2] / "fitting"
ASKS = """
import sys, time
from multiprocessing import active_children
from pathlib import Path
import numpy as np
from deixis_simulation.portraits import LANDMARKS, SIDE_PX
from fit_crops import Portraits
from fit_regression import CropMaker

if __name__ == "__main__":
    path, count = Path(sys.argv[1]) / "portraits.npz", 20
    pictures, places = np.zeros((count, SIDE_PX, SIDE_PX, 3), np.uint8), np.full((count, len(LANDMARKS), 2), 48.0)
    Portraits(pictures, np.tile(np.eye(3), (count, 1, 1)), places, np.full((count, 2), 48.0), np.full(count, 30.0)).save(path)
    with CropMaker([path]) as maker:
        maker.take()
        print(*[child.pid for child in active_children()], flush=True)
        time.sleep(600)
"""


def works(pid: int) -> bool:
    """Whether a process is there and not only waits to be buried."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


def test_the_maker_of_crops_ends_when_the_fit_is_killed(tmp_path: Path, wait_for, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", str(FITTING))
    script = tmp_path / "asks.py"
    script.write_text(ASKS)
    with subprocess.Popen([sys.executable, script, tmp_path], stdout=subprocess.PIPE, text=True) as fit:
        assert fit.stdout is not None
        makers = [int(pid) for pid in fit.stdout.readline().split()]
        fit.kill()
    assert len(makers) == 1
    wait_for(lambda: not any(works(pid) for pid in makers), "the maker to end")

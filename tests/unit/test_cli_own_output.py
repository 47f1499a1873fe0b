"""What a command prints is all that comes on standard output."""

import subprocess
import sys

LOUD = """
import os
from deixis_cli.own_output import keep_output_to_ourselves
print("before")
keep_output_to_ourselves()
os.write(1, b"a library's log\\n")
print("ours")
os.write(1, b"more of it\\n")
"""


def test_what_a_library_writes_to_standard_output_goes_to_standard_error():
    done = subprocess.run([sys.executable, "-c", LOUD], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == ["before", "ours"]
    assert done.stderr.splitlines() == ["a library's log", "more of it"]


def test_a_command_without_standard_output_still_runs():
    text = "import os, sys\nfrom deixis_cli.own_output import keep_output_to_ourselves\nos.close(1)\n"
    text += "keep_output_to_ourselves()\nsys.stderr.write('end')"
    assert subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True).stderr == "end"

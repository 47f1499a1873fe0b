"""The console script: help that is quick, and Ctrl-C at any time without a traceback."""

import subprocess
import sys

import pytest
from deixis_cli import overview
from deixis_cli.main import parser
from running import command

HEAVY = ("zenoh", "pydantic", "numpy", "cv2", "rich")


def ended(code, *arguments):
    """A fresh Python that runs the console script's function with these arguments, after `code`."""
    script = f"import sys; sys.argv = ['deixis', *{list(arguments)!r}]\n{code}"
    return subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=False)


def test_help_imports_no_command():
    code = f"""
import atexit
atexit.register(lambda: print([name for name in {HEAVY!r} if name in sys.modules]))
from deixis_cli.entry import command
command()
"""
    done = ended(code, "--help")
    assert done.returncode == 0
    assert done.stdout.splitlines()[-1] == "[]"
    assert "check-stage" in done.stdout


def test_help_says_of_each_command_what_the_command_says_itself(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "100")
    with pytest.raises(SystemExit):
        overview.show(["--help"])
    assert capsys.readouterr().out == parser().format_help()
    assert all(overview.line_on(entry) for entry in overview.installed())


def test_a_mistyped_command_is_refused_by_name_as_before():
    done = subprocess.run(command("deixis", "statsu"), capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    assert "invalid choice: 'statsu'" in done.stderr
    assert "status" in done.stderr
    assert subprocess.run(command("deixis"), capture_output=True, timeout=60, check=False).returncode == 2


@pytest.mark.parametrize("within", ["zenoh", "deixis_cli.status"])
def test_ctrl_c_in_the_imports_ends_it_without_a_traceback(within):
    code = f"""
import os, signal
class Interrupt:
    def find_spec(self, name, path=None, target=None):
        if name == {within!r}:
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Interrupt())
from deixis_cli.entry import command
command()
"""
    done = ended(code, "status", "--robot", "r")
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


def test_ctrl_c_stays_ignored_where_it_is_as_in_the_background_of_a_shell():
    code = """
import os, signal
signal.signal(signal.SIGINT, signal.SIG_IGN)
class Interrupt:
    def find_spec(self, name, path=None, target=None):
        if name == "zenoh":
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Interrupt())
from deixis_cli.entry import command
command()
"""
    done = ended(code, "paper", "--trials", "0")
    assert done.returncode == 2, "it goes on, to what is wrong with its arguments"

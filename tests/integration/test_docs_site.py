"""The pages build to a site: every page is in its list, and no link leads nowhere."""

import os
import re
import subprocess
import sys

from running import ROOT


def test_the_site_builds_without_a_warning(tmp_path):
    argv = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(tmp_path / "site")]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(argv, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=120, check=False)
    assert (done.returncode, done.stdout + done.stderr) == (0, "")
    home = (tmp_path / "site" / "index.html").read_text()
    links = set(re.findall(r'href="([^":#]+)[^":]*"', home))
    assert len(links) > 20
    for link in links:
        assert (tmp_path / "site" / link).is_file(), f"{link}: opened as a file, the site shows a list of what lies in a folder"
    assert "which thing a person is pointing at" in home
    for host in ("fonts.googleapis", "unpkg.com", "cdn."):
        assert host not in home, "the site is to be read where there is no internet"

"""The stock zenohd that tests run beside our router: named by DEIXIS_ZENOHD, on the PATH, or built by `make zenohd`.

There is none among the packages of the project, and its build takes minutes: it is done once, into the cache of the user.
"""

import os
import shutil
from pathlib import Path

BUILT = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "deixis" / "zenohd" / "bin" / "zenohd"
ZENOHD = os.environ.get("DEIXIS_ZENOHD") or shutil.which("zenohd") or (str(BUILT) if BUILT.exists() else None)
WHY_NO_ZENOHD = "" if ZENOHD else "there is no zenohd: `make zenohd` builds it (needs cargo), or name it in DEIXIS_ZENOHD"

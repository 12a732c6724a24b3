"""Optional packages: imported when they are used, and named with the command that installs it where it is missing.

The package is on no index: it is installed from its folder.
"""

from __future__ import annotations

from importlib.util import find_spec

from ..errors import MissingLibrary


def require(what: str, library: str, extra: str) -> None:
    """Refuse what needs a library that is not installed.

    Parameters
    ----------
    what : what needs it, in words: "pictures".
    library : its name, which is also its module's.
    extra : the extra of this package that brings it.

    Raises
    ------
    MissingLibrary
    """
    if find_spec(library) is None:
        raise MissingLibrary(what, library, f"pip install '.[{extra}]' in the folder of pfabrik's sources")

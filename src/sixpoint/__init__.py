"""Natural full-body poses from six tracked points.

    import sixpoint as sp

    motion = sp.load("17_10.amc")
    figure = sp.Figure.from_motion(motion)
    result = sp.SequentialIKPlus(figure).solve_motion(figure.targets(motion))
    sp.save(result, "boxing.bvh")

Metres, radians, seconds; Y up, Z forward, X to the figure's left; quaternions are xyzw.
"""

from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING

__version__ = "0.1.0"

if TYPE_CHECKING:
    from sixpoint.api import *  # noqa: F403
    from sixpoint.api import __all__  # noqa: F401
else:

    def __getattr__(name):
        """Import the library when something of it is asked for: so a command line begins at once."""
        unknown = AttributeError(f"module {__name__!r} has no attribute {name!r}")
        if name != "__all__":
            if name.startswith("_") or not name.isidentifier():  # as tools ask for __wrapped__ and such
                raise unknown
            if find_spec(f"{__name__}.{name}"):
                return import_module(f"{__name__}.{name}")
        api = import_module(f"{__name__}.api")
        if name != "__all__" and name not in api.__all__:
            raise unknown
        globals()[name] = found = getattr(api, name)
        return found

    def __dir__():
        return sorted({*globals(), *import_module("sixpoint.api").__all__})

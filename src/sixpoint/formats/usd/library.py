"""usd-core, imported when it is needed: it is large, and few need it."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

from sixpoint.errors import FormatError


def import_usd(path: Path) -> Any:
    """The modules of usd-core that are used here, as attributes.

    Raises:
        FormatError: It is not installed; the message says how to install it.
    """
    try:
        from pxr import Gf, Sdf, Tf, Usd, UsdGeom, UsdSkel, Vt
    except ImportError as error:
        raise FormatError(path, f'USD files need usd-core: pip install "sixpoint[usd]" ({error})') from None
    return SimpleNamespace(Gf=Gf, Sdf=Sdf, Tf=Tf, Usd=Usd, UsdGeom=UsdGeom, UsdSkel=UsdSkel, Vt=Vt)

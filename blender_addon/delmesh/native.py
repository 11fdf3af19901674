# SPDX-License-Identifier: GPL-3.0-or-later
"""The way to the library: the delmesh Python package, loaded when it is first needed and never at registration."""
import bpy


class Unavailable(Exception):
    """Says in a sentence why there is no library."""


_problem = None  # what the last attempt said; "" after success


def _package():
    try:
        from ._vendor import delmesh
    except ImportError:
        try:
            import delmesh  # a wheel or the system's
        except ImportError:
            delmesh = None
    # As a legacy add-on this module's own package is called delmesh.
    if not hasattr(delmesh, "remesh"):
        raise Unavailable("The delmesh Python package is missing: this is the source archive; install the packaged add-on.")
    return delmesh


def load():
    """-> the delmesh package, its library loaded. Raises Unavailable."""
    global _problem
    try:
        package = _package()
        settings = preferences()
        path = bpy.path.abspath(settings.path_to_library) if settings else ""
        try:
            if path:
                package.load_library(path)
            package.version()
        except package.DelmeshError as error:
            raise Unavailable("The native library of Delmesh is not usable: install the packaged add-on for this system. "
                              f"{error}") from None
    except Unavailable as error:
        _problem = str(error)
        raise
    _problem = ""
    return package


def preferences():
    """The add-on's, None while it is being installed or where it is used as a module."""
    addon = bpy.context.preferences.addons.get(__package__)
    return addon.preferences if addon else None


def isolated():
    """Whether the library runs in a process of its own."""
    settings = preferences()
    return settings is None or settings.isolate


def problem():
    """Why the library cannot be used, "" if it can. Cheap enough for drawing: only the first call tries to load it."""
    if _problem is None:
        try:
            load()
        except Unavailable:
            pass
    return _problem


def forget(_preferences=None, _context=None):
    """Lets go of the library, so that the next use loads it anew."""
    global _problem
    _problem = None
    try:
        _package().unload_library()
    except Unavailable:
        pass

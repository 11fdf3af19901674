# SPDX-License-Identifier: Apache-2.0
"""Finds, loads and checks the shared library. Nothing is loaded before it is needed, and it is closed again when nothing of it is
in use any more: on Windows a loaded library locks its folder."""
import ctypes as C
import gc
import os
import pathlib
import platform
import sys
import threading
import weakref

import _ctypes

from . import _capi
from .errors import AbiMismatch, LibraryNotFound

_SYSTEMS = {"linux": ("linux", "libdelmesh.so", "libdelmesh.so.0"), "darwin": ("macos", "libdelmesh.dylib", "libdelmesh.0.dylib"),
            "win32": ("windows", "delmesh.dll", "delmesh.dll")}
_MACHINES = {"x86_64": "x64", "amd64": "x64", "aarch64": "arm64", "arm64": "arm64"}
_SYSTEM, _FILE, _SONAME = _SYSTEMS.get(sys.platform, _SYSTEMS["linux"])
PLATFORM = f"{_SYSTEM}-{_MACHINES.get(platform.machine().lower(), platform.machine().lower())}"


class Library:
    """A loaded library: every function of delmesh.h as an attribute without its prefix. Whoever holds a handle of the library
    holds this object too; the last one to let go closes it."""

    def __init__(self, path):
        try:
            dll = C.CDLL(os.fspath(path))
        except OSError as error:
            raise LibraryNotFound(f"{path} could not be loaded: {error}") from None
        self.path = path
        weakref.finalize(self, getattr(_ctypes, "FreeLibrary", None) or _ctypes.dlclose, dll._handle).atexit = False
        try:
            for name, (result, *parameters) in _capi.PROTOTYPES.items():
                function = getattr(dll, name)
                function.restype, function.argtypes = result, parameters
                setattr(self, name.removeprefix("delmesh_"), function)
        except AttributeError:
            raise AbiMismatch(f"{path} has no function {name}; it is not the library that this package was made for.") from None
        if not self.get_api(_capi.DELMESH_ABI_VERSION):
            raise AbiMismatch(f"{path} does not speak ABI version {_capi.DELMESH_ABI_VERSION}, which this package was made for.")
        for struct in _capi.STRUCTS:
            ours, theirs = C.sizeof(struct), self.struct_size(struct.__name__.encode())
            # Structs that begin with their size may have grown in a newer library; the views are frozen.
            grows = struct._fields_[0][0] == "struct_size"
            if theirs < ours or (theirs > ours and not grows):
                raise AbiMismatch(f"{path} has a {struct.__name__} of {theirs} bytes, and this package expects {ours}.")
            for member, _ in struct._fields_:
                ours, theirs = getattr(struct, member).offset, self.field_offset(f"{struct.__name__}.{member}".encode())
                if theirs != ours:
                    raise AbiMismatch(f"{path} has {struct.__name__}.{member} at the byte {theirs}, and this package expects {ours}.")

    @property
    def version_string(self):
        number = self.version()
        return f"{number >> 16}.{number >> 8 & 255}.{number & 255}"


_lock = threading.RLock()  # a signal handler may come to it, too
_default = None


def load_library(path=None):
    """Loads the library and makes it the one that new contexts use. Without a path it is searched for: the file that the
    environment variable DELMESH_LIBRARY names, lib/<platform>/ and the folder of this package, the system's library path."""
    global _default
    library = Library(path) if path else _search()
    with _lock:
        _default = library
    return library


def loaded_library():
    """The library in use, loaded at the first call."""
    global _default
    with _lock:  # threads that come together must not get a Library each: meshes of one are refused by contexts of another
        if _default is None:
            _default = _search()
        return _default


def native_path():
    """The file of the library in use, which is loaded if there is none yet; a bare name where the system found it."""
    return os.fspath(loaded_library().path)


def unload_library():
    """Lets go of the library; it is closed as soon as no mesh, context or array of it is left."""
    global _default
    with _lock:
        _default = None
    gc.collect()  # what is only held by cycles, like those of caught exceptions


def _search():
    if path := os.environ.get("DELMESH_LIBRARY"):
        return Library(path)
    package = pathlib.Path(__file__).resolve().parent
    beside = [package / "lib" / PLATFORM / _FILE, package / _FILE]
    for path in beside:
        if path.is_file():
            return Library(path)
    try:
        return Library(_SONAME)
    except LibraryNotFound:
        raise LibraryNotFound(f"The library {_FILE} for {PLATFORM} was not found: not in {beside[0].parent}, not in the system's "
                              "library path, and DELMESH_LIBRARY is not set.") from None

# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs the library in another process: should it crash, that process is gone and Blender goes on. The helper is started at the
first run and kept for the next."""
import atexit
import os
import pathlib
import shutil
import subprocess
import sys
import sysconfig

import numpy as np

from . import shared


class HelperFailed(Exception):
    """Says in a sentence what became of the helper process."""


_helper = None


def helper(package):
    """The Helper, a new one if the last has ended."""
    global _helper
    if _helper is None or _helper.has_ended():
        close()
        _helper = Helper(package)
    return _helper


@atexit.register
def close():
    global _helper
    if _helper:
        _helper.stop()
    _helper = None


def _pythons():
    """Interpreters of this very version, the likeliest first; Blender's own process may not be one."""
    name = f"python{sys.version_info.major}.{sys.version_info.minor}"
    places = [pathlib.Path(sys.executable or "none"), pathlib.Path(sysconfig.get_path("stdlib")).parents[1] / "bin" / name,
              pathlib.Path(sys.base_prefix) / "bin" / name, pathlib.Path(sys.base_prefix) / "bin" / "python.exe"]
    return [str(place) for place in dict.fromkeys(places) if place.is_file() and place.name.startswith("python")]


class Helper:
    """Its process begins with the first run. stop() may come from another thread at any time."""

    def __init__(self, package):
        here = pathlib.Path(__file__).resolve().parent
        self._arguments = [str(here / "helper.py"), str(here), str(pathlib.Path(package.__file__).resolve().parents[1]),
                           str(package.native_path()), str(pathlib.Path(np.__file__).resolve().parents[1])]
        self._folder = shared.memory_folder()
        self._process, self._stopped = None, False

    def _start(self):
        hidden = {}
        if sys.platform == "win32":
            hidden["creationflags"] = subprocess.CREATE_NO_WINDOW | subprocess.BELOW_NORMAL_PRIORITY_CLASS
        for python in _pythons():
            # Not on standard error: the helper's words would look like Blender's.
            process = subprocess.Popen([python, "-I", "-B", *self._arguments], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                       stderr=subprocess.DEVNULL, **hidden)
            self._process = process
            if self._stopped:
                break
            if self._receive() == ("ready", None):
                return
            process.kill()
            process.wait()
        self.stop()
        raise HelperFailed("the helper process could not be started; Isolation can be switched off in the add-on's preferences")

    def has_ended(self):
        return self._stopped or (self._process is not None and self._process.poll() is not None)

    @property
    def pid(self):
        return self._process.pid

    def run(self, run, data, keep, options, progress):
        """What survive.RUNS[run] returns. Raises HelperFailed."""
        if not self._process:
            self._start()
        try:
            shared.send(self._process.stdin, (self._folder, run, data, keep, options), self._folder)
        except OSError:
            raise HelperFailed(self._end()) from None
        while True:
            answer = self._receive()
            if answer is None:
                raise HelperFailed(self._end())
            what, value = answer
            if what == "progress":
                if not progress(*value):
                    self.stop()
            elif what == "error":
                raise HelperFailed(value)
            else:
                return value

    def _receive(self):
        try:
            return shared.receive(self._process.stdout, __package__)
        except (OSError, EOFError, ValueError):
            return None

    def _end(self):
        code = self._process.wait()
        self.stop()
        how = f"signal {-code}" if code < 0 else f"exit code {code & 0xFFFFFFFF:#x}"
        return f"the library crashed ({how}) in its own process; Blender and the mesh are as they were"

    def stop(self):
        """Ends the process at once; what it was doing is lost."""
        self._stopped = True
        if self._process:
            self._process.kill()
            self._process.wait()
        shutil.rmtree(self._folder, ignore_errors=True)

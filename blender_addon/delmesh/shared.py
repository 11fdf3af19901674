# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects with large arrays from one process to another: what is small goes through a pipe, the arrays through a file in memory
(/dev/shm where there is one). Without bpy."""
import io
import mmap
import os
import pickle
import struct
import sys
import tempfile

_ALIGN = 64


def memory_folder():
    """A new folder for files of arrays: in memory if the system has such a place with room."""
    try:
        return tempfile.mkdtemp(prefix="delmesh-", dir="/dev/shm")
    except OSError:
        return tempfile.mkdtemp(prefix="delmesh-")


def send(stream, message, folder=None):
    """folder: where arrays go; without it they go through the pipe as well."""
    buffers = []
    text = pickle.dumps(message, protocol=5, buffer_callback=buffers.append if folder else None)
    path, places = None, []
    if buffers:
        path, places = _store([buffer.raw() for buffer in buffers], folder)
    head = pickle.dumps((path, places, text))
    stream.write(struct.pack("<Q", len(head)) + head)
    stream.flush()


def _store(buffers, folder):
    try:
        return _write(buffers, folder)
    except OSError:  # memory files have a limit of their own
        return _write(buffers, None)


def _write(buffers, folder):
    handle, path = tempfile.mkstemp(prefix="delmesh-", dir=folder)
    places = []
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(bytes(_ALIGN))  # an empty file cannot be mapped
            for buffer in buffers:
                places.append((file.tell(), buffer.nbytes))
                file.write(buffer)
                file.write(bytes(-file.tell() % _ALIGN))
    except OSError:
        os.unlink(path)
        raise
    return path, places


def receive(stream, package):
    """-> the message, None at the end of the stream. package: whose classes those of the add-on's modules are here."""
    size = stream.read(8)
    if len(size) < 8:
        return None
    head = stream.read(struct.unpack("<Q", size)[0])
    path, places, text = pickle.loads(head)
    buffers = []
    if path:
        with open(path, "rb") as file:
            memory = memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))
        try:
            os.unlink(path)
        except PermissionError:  # Windows: it goes with its folder
            pass
        buffers = [memory[begin:begin + size] for begin, size in places]
    return _Unpickler(io.BytesIO(text), buffers, package).load()


class _Unpickler(pickle.Unpickler):
    """The two sides know the add-on's modules by different names."""

    def __init__(self, file, buffers, package):
        super().__init__(file, buffers=buffers)
        self._package = package

    def find_class(self, module, name):
        last = module.rpartition(".")[2]
        if last in ("meshdata", "survive"):
            return getattr(sys.modules[f"{self._package}.{last}"], name)
        return super().find_class(module, name)

# SPDX-License-Identifier: Apache-2.0
"""What the tests of the command share: a folder of their own for each test."""
import tempfile
import unittest
from pathlib import Path


class FolderTest(unittest.TestCase):
    """self.folder is empty at the begin of each test, and gone after it."""

    def setUp(self):
        self.holder = tempfile.TemporaryDirectory()
        self.addCleanup(self.holder.cleanup)
        self.folder = Path(self.holder.name)

    def file(self, name, content):
        path = self.folder / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

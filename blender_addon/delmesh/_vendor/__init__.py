# SPDX-License-Identifier: GPL-3.0-or-later
"""The delmesh Python package. scripts/package-blender puts a copy here; in the source tree it is ../../../bindings/python."""
import pathlib

_bindings = pathlib.Path(__file__).resolve().parents[3] / "bindings" / "python"
if _bindings.is_dir():
    __path__.append(str(_bindings))

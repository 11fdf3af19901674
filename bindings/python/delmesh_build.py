# SPDX-License-Identifier: Apache-2.0
"""The build backend of the package (PEP 517): pip asks it for a wheel, it compiles the library with CMake and packs both.

It needs CMake and a C++20 compiler (GCC 12, Clang 14 or later), nothing from a package index, and no Python headers: ctypes needs
none, so one py3-none-<platform> wheel serves every Python. Settings, as in `pip wheel --config-settings library=libdelmesh.so`:

    library   carry this file instead of compiling one
    platform  the tag of the wheel, e.g. manylinux_2_28_x86_64; default: the running system's
"""
import base64
import hashlib
import io
import os
import pathlib
import platform
import re
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import tempfile
import zipfile

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

HERE = pathlib.Path(__file__).resolve().parent
# In a source distribution the sources of the library lie beside this file, in the repository above it.
SOURCES = HERE / "native" if (HERE / "native").is_dir() else HERE.parents[1]
NATIVE = ("CMakeLists.txt", "LICENSE", "cmake", "include_c", "libdelmesh")
WHEN = (2020, 1, 1, 0, 0, 0)  # the same files give the same bytes

# The start of a platform tag -> the system in names of ours, what the library is called in the package
SYSTEMS = {"manylinux": ("linux", "libdelmesh.so"), "musllinux": ("linux", "libdelmesh.so"), "linux": ("linux", "libdelmesh.so"),
           "macosx": ("macos", "libdelmesh.dylib"), "win": ("windows", "delmesh.dll")}


def project():
    return tomllib.loads((HERE / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def here_tag():
    tag = re.sub(r"[-. ]", "_", sysconfig.get_platform())
    # A universal Python says nothing of what the compiler makes, which is this machine's code.
    return re.sub(r"^macosx_\w+_universal2$", f"macosx_11_0_{platform.machine()}", tag)


def place_of(tag):
    """The library's path in the wheel: where delmesh/_library.py looks for it."""
    start = re.match(r"[a-z]+", tag)[0]
    if start not in SYSTEMS:
        raise SystemExit(f"delmesh: no system is known for the platform tag {tag}")
    system, name = SYSTEMS[start]
    return f"delmesh/lib/{system}-{'arm64' if tag.endswith(('arm64', 'aarch64')) else 'x64'}/{name}"


def compile_library(folder):
    """-> the library, compiled in `folder`."""
    if not shutil.which("cmake"):
        raise SystemExit("delmesh: compiling the library takes cmake and a C++20 compiler, and there is no cmake in the PATH")
    options = [f"-DDELMESH_{part}=OFF" for part in ("CLI", "TESTS", "BENCH", "EXAMPLES", "INSTALL")]
    output = pathlib.Path(folder) / "library"
    options += [f"-DCMAKE_{kind}_OUTPUT_DIRECTORY={output}" for kind in ("LIBRARY", "RUNTIME")]
    if shutil.which("ninja"):
        options.append("-GNinja")
    subprocess.run(["cmake", "-S", SOURCES, "-B", folder, "-DCMAKE_BUILD_TYPE=Release", *options], check=True)
    subprocess.run(["cmake", "--build", folder, "--parallel", str(os.cpu_count()), "--target", "delmesh"], check=True)
    return next(path for name in ("libdelmesh.so", "libdelmesh.dylib", "libdelmesh.dll", "delmesh.dll")
                if (path := output / name).is_file())


def metadata():
    about = project()
    lines = ["Metadata-Version: 2.1", f"Name: {about['name']}", f"Version: {about['version']}", f"Summary: {about['description']}",
             f"License: {about['license']['text']}", f"Requires-Python: {about['requires-python']}"]
    lines += [f"Requires-Dist: {need}" for need in about["dependencies"]]
    for extra, needs in about.get("optional-dependencies", {}).items():
        lines += [f"Provides-Extra: {extra}", *(f'Requires-Dist: {need}; extra == "{extra}"' for need in needs)]
    return "\n".join([*lines, "Description-Content-Type: text/markdown", "", (HERE / about["readme"]).read_text(encoding="utf-8")])


def package_files():
    return {f"delmesh/{path.name}": path for path in sorted((HERE / "delmesh").iterdir()) if path.suffix in (".py", ".typed")}


def write_wheel(folder, library, tag):
    """Packs the package and a library -> the wheel's file name. scripts/build-wheels calls it too."""
    about = project()
    stem = f"{about['name']}-{about['version']}"
    files = {name: path.read_bytes() for name, path in package_files().items()}
    files[place_of(tag)] = pathlib.Path(library).read_bytes()
    info = f"{stem}.dist-info"
    files[f"{info}/METADATA"] = metadata().encode()
    files[f"{info}/WHEEL"] = f"Wheel-Version: 1.0\nGenerator: delmesh_build\nRoot-Is-Purelib: false\nTag: py3-none-{tag}\n".encode()
    files[f"{info}/LICENSE"] = (SOURCES / "LICENSE").read_bytes()
    record = [f"{name},sha256={base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b'=').decode()},{len(data)}"
              for name, data in files.items()]
    files[f"{info}/RECORD"] = "\n".join([*record, f"{info}/RECORD,,", ""]).encode()
    wheel = f"{stem}-py3-none-{tag}.whl"
    with zipfile.ZipFile(pathlib.Path(folder) / wheel, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            entry = zipfile.ZipInfo(name, WHEN)
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, (0o755 if "/lib/" in name else 0o644) << 16
            archive.writestr(entry, data)
    return wheel


# ---- What pip calls --------------------------------------------------------------------------------------------------------


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    settings = config_settings or {}
    if unknown := set(settings) - {"library", "platform"}:
        raise SystemExit(f"delmesh: there is no setting {', '.join(sorted(unknown))}; there are library and platform")
    tag = settings.get("platform") or here_tag()
    if "library" in settings:
        return write_wheel(wheel_directory, settings["library"], tag)
    with tempfile.TemporaryDirectory() as folder:
        return write_wheel(wheel_directory, compile_library(folder), tag)


def build_sdist(sdist_directory, config_settings=None):
    about = project()
    stem = f"{about['name']}-{about['version']}"
    files = {path.name: path for path in (HERE / "pyproject.toml", HERE / "README.md", HERE / "delmesh_build.py")}
    files |= package_files()
    for top in NATIVE:
        below = [SOURCES / top] if (SOURCES / top).is_file() else [path for path in (SOURCES / top).rglob("*") if path.is_file()]
        files |= {f"native/{path.relative_to(SOURCES).as_posix()}": path for path in below}
    name = f"{stem}.tar.gz"
    with tarfile.open(pathlib.Path(sdist_directory) / name, "w:gz", format=tarfile.PAX_FORMAT) as archive:
        contents = {"PKG-INFO": metadata().encode(), **{key: path.read_bytes() for key, path in files.items()}}
        for key, data in sorted(contents.items()):
            entry = tarfile.TarInfo(f"{stem}/{key}")
            entry.size, entry.mode = len(data), 0o644
            archive.addfile(entry, io.BytesIO(data))
    return name

# SPDX-License-Identifier: Apache-2.0
"""A wheel and a source distribution made by pip, with a library that is there already, and each installed in a fresh virtual
environment, where the code in the documentation must run on what was installed. Needs no network: numpy is this Python's.
scripts/build-wheels does the same with compiled libraries, fresh numpys and other Pythons. Exit status 77: skipped.

    run_wheel.py LIBRARY
"""
import os
import pathlib
import subprocess
import sys
import tempfile
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "bindings" / "python"
ENVIRONMENT = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "DELMESH_LIBRARY")}
ENVIRONMENT |= {"PIP_DISABLE_PIP_VERSION_CHECK": "1", "PIP_NO_INDEX": "1", "PYTHONDONTWRITEBYTECODE": "1"}


def run(*command, cwd):
    done = subprocess.run([str(part) for part in command], cwd=cwd, env=ENVIRONMENT, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}")
    return done.stdout.strip()


def check(python, source, library, folder):
    """pip makes a wheel of `source`; it is looked at, installed and used."""
    folder.mkdir()
    run(python, "-m", "pip", "wheel", "-q", "--no-deps", "--config-settings", f"library={library}", "-w", folder, source,
        cwd=folder)
    (wheel,) = folder.glob("delmesh-*-py3-none-*.whl")
    names = set(zipfile.ZipFile(wheel).namelist())
    expected = {f"delmesh/{path.name}" for path in (PACKAGE / "delmesh").iterdir() if path.suffix == ".py"} | {"delmesh/py.typed"}
    missing = expected - names
    more = {name for name in names - expected if ".dist-info/" not in name}
    assert not missing and len(more) == 1 and next(iter(more)).startswith("delmesh/lib/"), (missing, more)
    run(python, "-m", "pip", "install", "-q", "--no-deps", "--force-reinstall", wheel, cwd=folder)
    found = run(python, "-c", "import delmesh._library as l; print(l.loaded_library().path)", cwd=folder)
    assert pathlib.Path(found).is_relative_to(python.parents[1].resolve()), f"{found} was loaded instead of the wheel's"
    run(python, ROOT / "tests" / "python" / "test_package.py", "Documentation", "ShortCalls", cwd=folder)
    print(f"{wheel.name} from {source.name}: {found.removeprefix(str(python.parents[1].resolve()))}")


def main():
    library = pathlib.Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        command = [sys.executable, "-m", "venv", "--system-site-packages", folder / "venv"]
        made = subprocess.run(command, capture_output=True, text=True)
        if made.returncode:
            print(f"SKIPPED: no virtual environment can be made: {made.stdout}{made.stderr}")
            sys.exit(77)
        python = folder / "venv" / "bin" / "python"
        run(python, "-c", f"import delmesh_build; delmesh_build.build_sdist({str(folder)!r})", cwd=PACKAGE)
        (sdist,) = folder.glob("delmesh-*.tar.gz")
        check(python, PACKAGE, library, folder / "tree")
        check(python, sdist, library, folder / "sdist")


if __name__ == "__main__":
    main()

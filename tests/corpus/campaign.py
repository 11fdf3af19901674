# SPDX-License-Identifier: Apache-2.0
"""What the campaigns over real meshes share: cases, the programs they drive, the table of figures, the last lines."""
import argparse
import concurrent.futures
import csv
import gzip
import json
import math
import os
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SHARED = Path(os.environ.get("DELMESH_SHARED", ROOT.parent / "shared"))
DATA = SHARED / "data"


class Check:
    """Collects what held and what did not, for one case."""

    def __init__(self, name):
        self.name, self.passed, self.failures, self.rows, self.notes = name, 0, [], [], []

    def that(self, condition, what):
        if condition:
            self.passed += 1
        else:
            self.failures.append(what)
        return bool(condition)

    def equal(self, got, wanted, what):
        return self.that(got == wanted, f"{what}: {got}, not {wanted}")


class Runner:
    def __init__(self, build, folder, limits):
        self.delmesh = build / "cli" / "delmesh"
        self.certifier = build / "tests" / "certifier" / "dm_certifier"
        self.level_check = build / "tests" / "corpus" / "level_check"
        self.folder, self.limits = folder, limits
        for program in (self.delmesh, self.certifier, self.level_check):
            if not program.exists():
                sys.exit(f"{program} is missing: build first")

    def call(self, *words, timeout=600.0, limited=False):
        """(exit status, standard output, standard error); the status is negative after a signal, None after the time limit."""
        words = [str(w) for w in words]
        if limited and self.limits:
            words = ["bash", "-c", 'ulimit -v 2097152; exec "$@"', "limited", *words]
        try:
            done = subprocess.run(words, capture_output=True, text=True, errors="replace", timeout=timeout,
                                  stdin=subprocess.DEVNULL)
        except subprocess.TimeoutExpired:
            return None, "", "time limit"
        return done.returncode, done.stdout, done.stderr

    def json_of(self, *words):
        status, out, err = self.call(*words)
        try:
            return status, json.loads(out)
        except ValueError:
            return status, {"error": (err or out).strip()[-300:]}

    def second_opinion(self, *words):
        return self.json_of(self.certifier, *words)

    def plain(self, source):
        """The path of the file itself, or of its unpacked copy: the second opinion reads no .gz."""
        if source.suffix != ".gz":
            return source
        copy = self.folder / "unpacked" / source.parent.name / source.name[:-3]
        if not copy.exists():
            copy.parent.mkdir(parents=True, exist_ok=True)
            part = copy.with_name(f"{copy.name}.{threading.get_ident()}")
            part.write_bytes(gzip.decompress(source.read_bytes()))
            part.replace(copy)
        return copy


def manifest():
    with open(DATA / "MANIFEST.tsv", newline="", encoding="utf-8") as table:
        return {(r["group"], r["name"]): r for r in csv.DictReader(table, delimiter="\t")}


def is_usable(row, precision):
    """A surface that can be made Delaunay: finite, orientable, with some area, all at the precision."""
    number = lambda key: float(row[key]) if row[key] not in ("", "-1") else 0.0
    return (row["status"] == "ok" and number("nanV") == 0 and number("oorIdx") == 0 and row["orientable"] == "1" and
            number("F") > number("zeroAreaF") and (precision == "f64" or 1e-44 < number("bboxDiag") < 3e38))


def compare_figures(checks, options, path, columns, keys):
    """The figures against the committed ones; the first `keys` columns name a row. Integers must be equal; the others may differ in
    their last digit: angles have three decimals, distances three digits and more, and the noise of measuring is below 1e-6."""
    check = Check(path.name)
    rows = {tuple(str(r[k]) for k in columns[:keys]): {k: str(r[k]) for k in columns} for c in checks for r in c.rows}
    committed = {}
    if path.exists():
        with open(path, newline="", encoding="utf-8") as table:
            committed = {tuple(r[k] for k in columns[:keys]): r for r in csv.DictReader(table)}
    if options.csv or options.update:
        merged = rows if options.csv else {**committed, **rows}
        path.parent.mkdir(parents=True, exist_ok=True)
        with open(path, "w", newline="", encoding="utf-8") as table:
            writer = csv.DictWriter(table, columns, lineterminator="\n")
            writer.writeheader()
            writer.writerows(merged[k] for k in sorted(merged))
        print(f"{path.relative_to(ROOT)}: {len(merged)} rows written")
        return check
    for key, row in sorted(rows.items()):
        if key not in committed:
            check.that(False, f"{' '.join(key)}: not in the file (--update writes it)")
            continue
        for column in columns[keys:]:
            new, old = row[column], committed[key][column]
            equal = new == old
            if not equal and "." in old + new:
                distance = column in ("hausdorff_percent", "rms_percent")
                equal = math.isclose(float(new), float(old), rel_tol=1e-2 if distance else 2e-3, abs_tol=2e-6 if distance else 2e-3)
            check.that(equal, f"{' '.join(key)}: {column} is {new}, was {old}")
    return check


def run_cases(cases, jobs, print_rows):
    """The checks of all cases, in their order; each is printed as it ends."""
    checks = []

    def work(case):
        _, function, arguments, named = case
        try:
            return function(*arguments, **named)
        except Exception as error:  # a defect of the data or of this script: a failure that says where
            broken = Check(f"{function.__name__} {' '.join(str(getattr(a, 'name', a)) for a in arguments[1:4])}")
            broken.that(False, f"{type(error).__name__}: {error}")
            return broken

    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        for check in pool.map(work, cases):
            checks.append(check)
            print_rows(check)
            for failure in check.failures:
                print(f"FAILED {check.name}: {failure}", flush=True)
    return checks


def judge_nasty(checks):
    """How many of the nasty ones with a usable surface were certified, by group of cases."""
    nasty, shares = [c for c in checks if hasattr(c, "usable")], []
    for group in sorted({c.group for c in nasty}):
        usable = [c for c in nasty if c.usable and c.group == group]
        good = sum(c.certified for c in usable)
        share = Check(f"nasty {group}")
        share.that(good >= 0.9 * len(usable), f"{good} of {len(usable)} usable surfaces certified, less than 90 %")
        print(f"nasty {group}: {good} of {len(usable)} usable surfaces certified")
        for c in usable:
            if not c.certified:
                print(f"  not: {c.name}: {c.note}")
        shares.append(share)
    return shares


def conclude(checks, case_count, began):
    """The last lines; the exit status."""
    for check in checks[case_count:]:
        for failure in check.failures:
            print(f"FAILED {check.name}: {failure}")
    failed = sum(bool(c.failures) for c in checks)
    statements = sum(c.passed for c in checks)
    print(f"{case_count} cases, {statements} statements held, {time.monotonic() - began:.0f} s")
    print(f"{len(checks) - failed} passed, {failed} failed, 0 skipped")
    return 1 if failed or not checks else 0


def parse_options(description):
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--build", type=Path, required=True)
    parser.add_argument("--short", action="store_true")
    parser.add_argument("--smoke", action="store_true")
    parser.add_argument("--only", default="")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--csv", action="store_true")
    parser.add_argument("--update", action="store_true")
    parser.add_argument("--keep", type=Path, help="work in this folder and keep what is left there")
    parser.add_argument("--no-limits", action="store_true", help="no memory limit (sanitizers need address space)")
    return parser.parse_args()


def run_campaign(description, plan, head, line_of, table, columns, keys):
    """From the command line to the exit status. plan(run, options): the cases; head and line_of(name, row): what is printed of the
    rows; table, columns, keys: of compare_figures."""
    options = parse_options(description)
    if not (DATA / "MANIFEST.tsv").exists():
        print(f"skipped: the shared data is not at {DATA}")
        print("0 passed, 0 failed, 1 skipped")
        return 77

    def print_rows(check):
        for row in check.rows:
            print(line_of(check.name, row), flush=True)
        for note in check.notes:
            print(f"{check.name}: {note}", flush=True)

    with tempfile.TemporaryDirectory() as temporary:
        folder = options.keep.resolve() if options.keep else Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        cases = plan(Runner(options.build.resolve(), folder, not options.no_limits), options)
        began = time.monotonic()
        print(head)
        checks = run_cases(cases, options.jobs, print_rows)
    checks += judge_nasty(checks)
    if options.update or not (options.smoke or options.only):
        checks.append(compare_figures(checks, options, table, columns, keys))
    return conclude(checks, len(cases), began)

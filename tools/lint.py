"""Checks how the code is written: tools/lint.py [--fix] [format] [ruff] [tidy] (default: all three).

clang-tidy looks only at sources that changed, or whose headers did, since it last found nothing in them.
"""

import argparse
import functools
import hashlib
import json
import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
TOOLS = ROOT / "build/venv/bin"
NATIVE = ROOT / "native"
# Commands of the preset that compiles each file by itself.
COMPILE_COMMANDS = ROOT / "build/dev/compile_commands.json"
STAMPS = ROOT / "build/.tidy"
PYTHON_FOLDERS = ["addon", "tests", "tools", "blend_examples", "docs"]
PROJECT_INCLUDE = re.compile(rb'^\s*#\s*include\s+"([^"]+)"', re.MULTILINE)


def run(*command: str) -> bool:
    return subprocess.run(command, cwd=ROOT, check=False).returncode == 0


def check_format(fix: bool) -> bool:
    files = sorted(str(path.relative_to(ROOT)) for path in NATIVE.rglob("*") if path.suffix in (".cpp", ".h"))
    return run(str(TOOLS / "clang-format"), *(["-i"] if fix else ["--dry-run", "-Werror"]), *files)


def check_ruff(fix: bool) -> bool:
    folders = [folder for folder in PYTHON_FOLDERS if (ROOT / folder).exists()]
    ruff = str(TOOLS / "ruff")
    # Not short-circuited: one run shows everything.
    return all(
        [
            run(ruff, "check", "--quiet", *(["--fix"] if fix else []), *folders),
            run(ruff, "format", "--quiet", *([] if fix else ["--diff"]), *folders),
        ]
    )


@functools.cache
def source_and_headers(path: Path) -> frozenset[Path]:
    """The file and the headers of this project that it includes, directly or not."""
    found = {path}
    for name in PROJECT_INCLUDE.findall(path.read_bytes()):
        header = NATIVE / name.decode()
        if header.exists() and header != path:
            found |= source_and_headers(header)
    return frozenset(found)


def check_tidy() -> bool:
    tidy = str(TOOLS / "clang-tidy")
    configuration = (ROOT / ".clang-tidy").read_bytes() + subprocess.check_output([tidy, "--version"])
    # Afresh, as a cache would keep the libraries that it once found.
    subprocess.run(["cmake", "--fresh", "--preset", "dev"], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    commands = {Path(entry["file"]): entry["command"] for entry in json.loads(COMPILE_COMMANDS.read_text())}
    STAMPS.mkdir(parents=True, exist_ok=True)

    def check(source: Path) -> str:
        key = hashlib.sha256(configuration + commands[source].encode())
        for path in sorted(source_and_headers(source)):
            key.update(path.read_bytes())
        stamp = STAMPS / str(source.relative_to(NATIVE)).replace("/", "-")
        if stamp.exists() and stamp.read_text() == key.hexdigest():
            return ""
        result = subprocess.run(
            [tidy, "--quiet", "-p", str(COMPILE_COMMANDS.parent), str(source)],
            cwd=ROOT,
            capture_output=True,
            text=True,
            check=False,
        )
        if result.returncode == 0:
            stamp.write_text(key.hexdigest())
            return ""
        return result.stdout + result.stderr

    sources = sorted(path for path in commands if path.is_relative_to(NATIVE) and path.exists())
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        complaints = [text for text in pool.map(check, sources) if text]
    print(*complaints, sep="\n", end="")
    return not complaints


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fix", action="store_true", help="rewrite what format and ruff can put right")
    parser.add_argument("checks", nargs="*", choices=["format", "ruff", "tidy", "all"], default="all")
    arguments = parser.parse_args()
    checks = ["format", "ruff", "tidy"] if "all" in arguments.checks else arguments.checks
    good = True
    if "format" in checks and not check_format(arguments.fix):
        print("lint: put right by `tools/lint.py --fix format`", file=sys.stderr)
        good = False
    if "ruff" in checks and not check_ruff(arguments.fix):
        print("lint: put right, as far as ruff can, by `tools/lint.py --fix ruff`", file=sys.stderr)
        good = False
    if "tidy" in checks and not check_tidy():
        good = False
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())

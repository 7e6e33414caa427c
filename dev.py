#!/usr/bin/env python3
"""The one developer command: sets up, builds, tests, checks and measures Quadloom. Needs only Python 3.11.

    python3 dev.py demo       # two quad models joined inside Blender, with pictures in out/
    python3 dev.py test       # every test; what CI runs
    python3 dev.py VERB -h    # help of one verb

Works from any folder, and again after an interruption. Test tools from PyPI go into .venv; what is large and shared between
clones (build tools, compiled dependencies, wheels, Blender) goes into $QUADLOOM_CACHE, by default ~/.cache/quadloom.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import re
import shutil
import subprocess
import sys
import time
import zipfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).resolve().parent
sys.path.insert(0, str(ROOT / "tools"))

import blenders  # noqa: E402  (found through the line above)

VENV = ROOT / ".venv"
OUT = ROOT / "out"
CACHE = blenders.cache_folder()
ON_WINDOWS = sys.platform == "win32"
BIN = "Scripts" if ON_WINDOWS else "bin"
PYTHON = "python.exe" if ON_WINDOWS else "python"
VENV_PYTHON = VENV / BIN / PYTHON
WHEEL_SOURCES = ("Cargo.toml", "Cargo.lock", "native")
DEMO_RUNTIME = "bpy-5.0"


class Failure(Exception):
    """Something the developer can mend; the message says how."""


# Setting up


def setup() -> None:
    """Installs the pinned tools and makes sure of the compilers."""
    if sys.version_info < (3, 11):  # noqa: UP036 (whoever runs this may have an older one)
        raise Failure(f"Python 3.11 or later is needed; this is {sys.version.split()[0]}.")
    require_compilers()
    tools = build_tools()
    with blenders.install(tools, gigabytes=1.0) as needed:
        if needed:
            with step(f"install the build tools into {tools}"):
                make_environment(tools, ROOT / "tools" / "build-requirements.txt")
    requirements = ROOT / "tools" / "requirements.txt"
    wanted = digest([requirements], extra=sys.version)
    stamp = VENV / "requirements.sha256"
    if not (stamp.exists() and stamp.read_text() == wanted):
        with step("install the test tools into .venv"):
            make_environment(VENV, requirements)
        stamp.write_text(wanted)


def build_tools() -> Path:
    """The virtual environment of what compiles the wheel. It is the same for every clone, because cargo compiles the
    dependencies again when the path of a tool changes."""
    return CACHE / f"build-tools-{digest([ROOT / 'tools' / 'build-requirements.txt'], extra=sys.version)[:16]}"


def make_environment(folder: Path, requirements: Path) -> None:
    """A new virtual environment with those packages. A half-made or outdated one is made anew: pip's own cache makes that
    cheap."""
    run([sys.executable, "-m", "venv", "--clear", str(folder)])
    pip(folder, "install", "--requirement", str(requirements))


def require_compilers() -> None:
    """Names each missing compiler with the way to get it."""
    missing = []
    if find_cargo() is None:
        missing.append("Rust 1.88 or later: install rustup (https://rustup.rs), or your distribution's cargo and rustc")
    if ON_WINDOWS:
        pass  # The cmake crate finds Visual Studio by itself and says so when it is missing.
    elif not any(shutil.which(name) for name in ("c++", "g++", "clang++")):
        missing.append("a C++ compiler: on Debian and Ubuntu apt-get install g++, on macOS xcode-select --install")
    if missing:
        raise Failure("Missing:\n  " + "\n  ".join(missing))


def find_cargo() -> str | None:
    """Cargo on the PATH, or where rustup puts it."""
    return shutil.which("cargo") or shutil.which("cargo", path=str(Path.home() / ".cargo" / "bin"))


def build_environment() -> dict[str, str]:
    """The environment for cargo and maturin: the build tools first, libclang for the HiGHS bindings, a shared target."""
    cargo = find_cargo()
    tools = build_tools()
    path = [str(tools / BIN), os.environ["PATH"]]
    if cargo is not None:
        path.insert(1, str(Path(cargo).parent))
    libclang = next(iter(tools.glob("**/clang/native")), None)
    environment = {**os.environ, "PATH": os.pathsep.join(path)}
    environment.setdefault("CARGO_TARGET_DIR", str(CACHE / "target"))
    if libclang is not None:
        environment.setdefault("LIBCLANG_PATH", str(libclang))
    return environment


def pip(environment: Path, *arguments: str) -> None:
    """Runs the pip of a virtual environment."""
    command, *rest = arguments
    run([str(environment / BIN / PYTHON), "-m", "pip", command, "--quiet", "--disable-pip-version-check", *rest])


# Building


def wheel() -> Path:
    """Builds the portable wheel, or finds the one built from the same sources, and installs it into .venv."""
    setup()
    wheel_sources = [ROOT / name for name in WHEEL_SOURCES]
    key = digest(wheel_sources)
    folder = CACHE / "dist" / key[:16]
    if not list(folder.glob("*.whl")):
        command = ["maturin", "build", "--release", "--locked", "--quiet", "--out", str(folder)]
        # From a folder above the build tools zig would name its headers by relative paths, and bindgen, which runs
        # elsewhere, would not find them: so from the crate's.
        crate = ROOT / "native" / "python"
        if sys.platform == "linux":
            # zig links against an old glibc and brings the C++ library along: runs in every supported Blender.
            command += ["--zig", "--compatibility", "manylinux_2_28"]
        with step("build the wheel (the first time takes 5 to 10 minutes)"):
            run(command, environment=build_environment(), folder=crate)
        if digest(wheel_sources) != key:
            shutil.rmtree(folder)
            raise Failure("native/ changed during the build; run this again.")
    built = one(folder.glob("*.whl"), f"wheel in {folder}")
    stamp = VENV / "quadloom.sha256"
    if not (stamp.exists() and stamp.read_text() == key):
        with step(f"install {built.name} into .venv"):
            pip(VENV, "install", "--force-reinstall", "--no-deps", str(built))
        stamp.write_text(key)
    return built


def extension() -> Path:
    """Zips the add-on with the wheel inside, the way Blender installs extensions."""
    bundled = wheel()
    manifest = (ROOT / "addon" / "blender_manifest.toml").read_text()
    filled, count = re.subn(r"^wheels\s*=\s*\[[^\]]*\]", f'wheels = ["./wheels/{bundled.name}"]', manifest, flags=re.MULTILINE)
    if count != 1:
        raise Failure("addon/blender_manifest.toml needs one line `wheels = []` for the build to fill.")
    version = re.search(r'^version\s*=\s*"([^"]+)"', manifest, flags=re.MULTILINE)
    if version is None:
        raise Failure("addon/blender_manifest.toml names no version.")
    OUT.mkdir(exist_ok=True)
    target = OUT / f"quadloom-{version[1]}.zip"
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in sources([ROOT / "addon"]):
            if path.name != "blender_manifest.toml":
                archive.write(path, path.relative_to(ROOT / "addon").as_posix())
        archive.writestr("blender_manifest.toml", filled)
        archive.write(ROOT / "LICENSE", "LICENSE")
        archive.write(bundled, f"wheels/{bundled.name}")
    say(f"{target.relative_to(ROOT)}: {target.stat().st_size / 1e6:.1f} MB")
    return target


def demo() -> None:
    """Runs demo/demo.py in Blender with the packed extension."""
    archive = extension()
    runtime = blenders.ensure(DEMO_RUNTIME)
    with step(f"run the demo in {DEMO_RUNTIME}"):
        arguments = ["--extension", str(archive), "--out", str(OUT)]
        done = runtime.run(ROOT / "demo" / "demo.py", arguments, timeout=1800)
    if done.returncode != 0:
        raise Failure(f"The demo failed with exit code {done.returncode}; its output is above.")


# Testing


def test(only: Sequence[str]) -> int:
    """Runs the suites and closes on one line: N passed, N failed. The exit code."""
    suites = {"native": test_native, "api": test_api, "repo": test_repo, "blender": test_blender}
    totals = [0, 0, 0]
    start = time.monotonic()
    for name in only or suites:
        with step(f"tests: {name}"):
            for command, environment in suites[name]():
                counts = run_counted(command, environment)
                totals = [total + count for total, count in zip(totals, counts, strict=True)]
    passed, failed, skipped = totals
    say(f"test: done in {time.monotonic() - start:.0f} s")
    print(f"{passed} passed, {failed} failed" + (f", {skipped} skipped" if skipped else ""), flush=True)
    return 0 if passed and not failed else 1


Suite = Iterator[tuple[list[str], dict[str, str]]]


def test_native() -> Suite:
    """Rust: units and properties beside the code, then the examples in the documentation."""
    setup()
    environment = build_environment()
    cargo = find_cargo() or "cargo"
    if shutil.which("cargo-nextest", path=environment["PATH"]):
        yield [cargo, "nextest", "run", "--workspace", "--locked", "--no-fail-fast"], environment
        yield [cargo, "test", "--workspace", "--locked", "--doc", "--no-fail-fast"], environment
    else:
        yield [cargo, "test", "--workspace", "--locked", "--no-fail-fast"], environment


def test_api() -> Suite:
    """The wheel from Python, without Blender."""
    wheel()
    yield pytest("tests/api"), dict(os.environ)


def test_repo() -> Suite:
    """The repository itself: layers, the map from papers to code, licences."""
    setup()
    yield pytest("tests/repo"), build_environment()


def test_blender() -> Suite:
    """The packed extension inside every Blender that tools/blenders.py knows."""
    archive = extension()
    yield [str(VENV_PYTHON), str(ROOT / "tests" / "blender" / "run.py"), "--extension", str(archive)], dict(os.environ)


def pytest(folder: str) -> list[str]:
    return [str(VENV_PYTHON), "-m", "pytest", "-q", "-p", "no:cacheprovider", str(ROOT / folder)]


# What each runner's closing lines look like: (pattern of a count, which of passed, failed, skipped it is).
CLOSING_LINE = re.compile(r"tests? run:|^test result:|^=*\s*\d+ (passed|failed|skipped|error)")
COUNTS = (r"(\d+) passed", r"(\d+) (?:failed|errors?|timed out|exec failed)\b", r"(\d+) (?:skipped|ignored)")
# Only these runners speak once for each test binary; the others repeat themselves, and the last word counts.
ADDED_UP = "test result:"


def run_counted(command: Sequence[str], environment: dict[str, str]) -> tuple[int, int, int]:
    """Runs a test command, passes its output on, and reads passed, failed and skipped from its closing lines.

    A runner that fails without counting a failure (it crashed, or could not start) counts as one failure."""
    totals = (0, 0, 0)
    with subprocess.Popen(
        command, cwd=ROOT, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        text=True, errors="replace",
    ) as process:  # fmt: skip
        assert process.stdout is not None
        for line in process.stdout:
            print(line, end="", flush=True)
            plain = re.sub(r"\x1b\[[0-9;]*m", "", line).strip()
            if CLOSING_LINE.search(plain):
                found = read_counts(plain)
                added = ADDED_UP in plain
                totals = tuple(a + b for a, b in zip(totals, found, strict=True)) if added else found  # type: ignore[assignment]
    passed, failed, skipped = totals
    if process.returncode != 0 and failed == 0:
        say(f"{Path(command[0]).name} ended with exit code {process.returncode}: counted as one failure")
        failed = 1
    return passed, failed, skipped


def read_counts(line: str) -> tuple[int, int, int]:
    """Passed, failed and skipped in a runner's closing line."""
    passed, failed, skipped = (sum(int(n) for n in re.findall(pattern, line)) for pattern in COUNTS)
    return passed, failed, skipped


# Checking


def check() -> None:
    """Format, lint, types, stubs and layers; every finding is printed before it fails."""
    wheel()
    environment = build_environment()
    cargo = find_cargo() or "cargo"
    python = [str(VENV_PYTHON), "-m"]
    folders = [name for name in ("dev.py", "tools", "addon", "tests", "bench", "demo") if (ROOT / name).exists()]
    checks = {
        "Rust format": [cargo, "fmt", "--all", "--check"],
        "Rust lint": [cargo, "clippy", "--workspace", "--all-targets", "--locked", "--", "-D", "warnings"],
        "Python format": [*python, "ruff", "format", "--check", *folders],
        "Python lint": [*python, "ruff", "check", *folders],
        "Python types": [*python, "mypy", "dev.py", "tools", "bench"],
        "stubs": stub_check(),
        "layers and papers": pytest("tests/repo"),
    }
    failed = []
    for name, command in checks.items():
        with step(name):
            if subprocess.run(command, cwd=ROOT, env=environment, stdin=subprocess.DEVNULL).returncode != 0:
                failed.append(name)
    if failed:
        raise Failure(f"Not in order: {', '.join(failed)}.")


def stub_check() -> list[str]:
    """Compares the type stubs with the installed wheel. maturin puts the library one level down; it is no interface."""
    allowed = str(ROOT / "tests" / "api" / "stubs_allowed.txt")
    # pyo3 does not mark its classes with the decorator that newer type checkers know.
    return [str(VENV_PYTHON), "-m", "mypy.stubtest", "quadloom", "--allowlist", allowed, "--ignore-disjoint-bases"]


# Measuring


def bench(name: str, arguments: Sequence[str]) -> None:
    """Runs one of the scripts in bench/ with its own arguments."""
    wheel()
    if name == "speed":
        # Against Blender's own solver, so inside Blender.
        archive = extension()
        runtime = blenders.ensure(DEMO_RUNTIME)
        code = runtime.run(ROOT / "bench" / "speed.py", ["--extension", str(archive), *arguments], timeout=3600).returncode
    else:
        command = [str(VENV_PYTHON), str(ROOT / "bench" / f"{name}.py"), *arguments]
        code = subprocess.run(command, cwd=ROOT).returncode
    if code != 0:
        raise Failure(f"bench/{name}.py ended with exit code {code}.")


def pictures() -> None:
    """Draws the pictures that tests/pictures compares, into out/pictures."""
    archive = extension()
    command = [str(VENV_PYTHON), str(ROOT / "tests" / "pictures" / "run.py"), "--extension", str(archive)]
    run([*command, "--out", str(OUT / "pictures")])


# Helpers


@contextmanager
def step(what: str) -> Iterator[None]:
    """Says what is being done and, at the end, how long it took."""
    say(f"{what} ...")
    start = time.monotonic()
    try:
        yield
    finally:
        say(f"{what}: {time.monotonic() - start:.1f} s")


def say(text: str) -> None:
    print(f"[dev] {text}", flush=True)


def run(command: Sequence[str], environment: dict[str, str] | None = None, folder: Path = ROOT) -> None:
    """Runs a command in a folder of the repository; a failure ends the verb with the command named."""
    code = subprocess.run(command, cwd=folder, env=environment, stdin=subprocess.DEVNULL).returncode
    if code != 0:
        raise Failure(f"Exit code {code} from: {' '.join(command)}")


def sources(paths: Iterable[Path]) -> list[Path]:
    """The files under `paths` in a fixed order, without what Python and its tools leave behind."""
    found: list[Path] = []
    for path in paths:
        found += [path] if path.is_file() else [p for p in path.rglob("*") if p.is_file()]
    left_behind = re.compile(r"^(__pycache__|\..*)$")
    return sorted(p for p in found if not any(left_behind.match(part) for part in p.relative_to(ROOT).parts))


def digest(paths: Iterable[Path], extra: str = "") -> str:
    """One hash over the names and contents of all files under `paths`."""
    state = hashlib.sha256(extra.encode())
    for path in sources(paths):
        content = path.read_bytes()
        state.update(f"{path.relative_to(ROOT).as_posix()}\0{len(content)}\0".encode())
        state.update(content)
    return state.hexdigest()


def one(paths: Iterable[Path], what: str) -> Path:
    """The only path, or a failure that names what was looked for."""
    found = list(paths)
    if len(found) != 1:
        raise Failure(f"Expected one {what}, found {len(found)}.")
    return found[0]


def parse(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="dev.py", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")

    def verb(name: str, text: str) -> argparse.ArgumentParser:
        return verbs.add_parser(name, help=text, description=text)

    verb("setup", "Install the pinned build and test tools and check for Rust and a C++ compiler.")
    verb("demo", "Build everything, join real models inside Blender, and leave demo.blend and pictures in out/.")
    suite = verb("test", "Run every test: Rust, the wheel, the repository, the extension in each Blender.")
    suite.add_argument("suite", nargs="?", choices=["native", "api", "repo", "blender"], help="only this one")
    verb("check", "Check format, lint, types, stubs and layers.")
    measure = verb("bench", "Measure: random placements and retopology against their bars, or speed against Blender's EXACT.")
    measure.add_argument("name", choices=["placements", "retopology", "speed"])
    measure.add_argument("arguments", nargs=argparse.REMAINDER, help="passed on to the script; try -h")
    verb("wheel", "Build the portable wheel (skipped while native/ is unchanged) and install it into .venv.")
    verb("extension", "Build the wheel and zip it with the add-on into out/.")
    verb("pictures", "Draw the interface and results inside Blender into out/pictures.")
    return parser.parse_args(arguments)


def main() -> int:
    given = parse()
    start = time.monotonic()
    try:
        if given.verb == "test":
            return test([given.suite] if given.suite else [])
        if given.verb == "bench":
            bench(given.name, given.arguments)
        else:
            {
                "setup": setup, "demo": demo, "check": check, "wheel": wheel, "extension": extension,
                "pictures": pictures,
            }[given.verb]()  # fmt: skip
    except (Failure, blenders.RuntimeUnavailable) as failure:
        print(f"dev.py {given.verb}: {failure}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    say(f"{given.verb}: done in {time.monotonic() - start:.0f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())

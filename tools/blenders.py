"""The Blenders that the tests and the demo run in: installed once, cached outside the repository.

Four runtimes, by name:

  bpy-4.2, bpy-4.5, bpy-5.0   Blender as a Python module, each in a virtual environment of its own (about 1 GB each)
  blender                     a real `blender -b`: $QUADLOOM_BLENDER, or a `blender` of 4.2 or later on the PATH, or Debian
                              trixie's Blender 4.3 in a chroot (about 2 GB, needs root)

The cache is $QUADLOOM_CACHE, by default ~/.cache/quadloom. Only the standard library is used, so that dev.py can import this:

  runtime = blenders.ensure("bpy-4.2")
  done = runtime.run(script, ["--flag", "value"], timeout=600)      # subprocess.CompletedProcess

Every script gets its arguments after "--" in sys.argv, whichever the runtime, and a HOME of its own, so that no run sees
another's preferences or installed extensions.
"""

from __future__ import annotations

import argparse
import ctypes
import fcntl
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parent.parent
BPY_VERSIONS = {"bpy-4.2": "4.2.23", "bpy-4.5": "4.5.15", "bpy-5.0": "5.0.1"}
NAMES = (*BPY_VERSIONS, "blender")
OLDEST_BLENDER = (4, 2)
DEBIAN_SUITE = "trixie"
PYTEST_VERSION = "8.4.2"

# The shared libraries bpy is linked to that slim images lack, and the Debian package of each.
SYSTEM_LIBRARIES = {
    "libGL.so.1": "libgl1",
    "libEGL.so.1": "libegl1",
    "libX11.so.6": "libx11-6",
    "libXrender.so.1": "libxrender1",
    "libXfixes.so.3": "libxfixes3",
    "libXi.so.6": "libxi6",
    "libxkbcommon.so.0": "libxkbcommon0",
    "libSM.so.6": "libsm6",
    "libICE.so.6": "libice6",
    "libXext.so.6": "libxext6",
}
# What libEGL loads at run time to draw without a display.
DRAWING_PACKAGES = ("libegl-mesa0", "libgl1-mesa-dri")
# Blender itself, what its add-on system imports, and what the panel pictures need (a virtual display, a screen grabber).
CHROOT_PACKAGES = ("blender", "python3-numpy", "python3-requests", "libgl1-mesa-dri", "xvfb", "xauth", "imagemagick")

# Runs inside a private mount namespace: the binds end with the process, so nothing can be left mounted.
ENTER_CHROOT = """set -e
root=$1; shift
mount -t proc proc "$root/proc"
mount --rbind /dev "$root/dev"
while [ "$1" != -- ]; do
    mkdir -p "$root$1"
    mount --bind "$1" "$root$1"
    shift
done
shift
exec chroot "$root" "$@"
"""


class RuntimeUnavailable(Exception):
    """A runtime that cannot be had on this machine; the message says why and what to do."""


@dataclass(frozen=True)
class Runtime:
    """One installed Blender."""

    name: str
    command: tuple[str, ...]
    """The Python interpreter of a bpy, or the Blender executable as seen from inside `chroot`."""
    chroot: Path | None = None
    packages: Path = field(default_factory=lambda: cache_folder() / "pytest")
    """Pure-Python packages (pytest) that tests put on sys.path: they reach scripts as $QUADLOOM_TEST_PACKAGES."""

    @property
    def is_module(self) -> bool:
        """Whether this is the bpy module rather than a Blender executable."""
        return self.name in BPY_VERSIONS

    def run(
        self,
        script: Path,
        args: Sequence[str] = (),
        *,
        timeout: float,
        home: Path | None = None,
        environment: dict[str, str] | None = None,
        capture: bool = False,
        mounts: Sequence[Path] = (),
        background: bool = True,
    ) -> subprocess.CompletedProcess[str]:
        """Runs `script` in a fresh process; after `timeout` seconds the whole process group is killed (return code -9).

        `home` is the process's HOME (a temporary folder unless given). The repository and `home` can be read and written
        by the script; `mounts` names further folders for the chroot. `background=False` opens Blender's window on a
        virtual display (the `blender` runtime only)."""
        if home is None:
            with tempfile.TemporaryDirectory(prefix="quadloom-home-") as folder:
                return self.run(
                    script, args, timeout=timeout, home=Path(folder), environment=environment,
                    capture=capture, mounts=mounts, background=background,
                )  # fmt: skip
        if self.is_module:
            call = [*self.command, str(script), "--", *args]
        elif background:
            call = [*self.command, "-b", "--factory-startup", "--python-exit-code", "1"]
            call += ["--python", str(script), "--", *args]
        else:
            screen = ["xvfb-run", "-a", "-s", "-screen 0 1280x800x24 +extension GLX"]
            call = [*screen, *self.command, "--factory-startup", "--python-exit-code", "1"]
            call += ["--window-geometry", "0", "0", "1280", "800", "--python", str(script), "--", *args]
        variables = {
            "HOME": str(home),
            "PATH": os.environ["PATH"],
            "LANG": "C.UTF-8",
            "LIBGL_ALWAYS_SOFTWARE": "1",
            "PYTHONDONTWRITEBYTECODE": "1",
            "QUADLOOM_TEST_PACKAGES": str(self.packages),
            **(environment or {}),
        }
        if self.chroot is not None:
            variables["PATH"] = "/usr/local/bin:/usr/bin:/usr/sbin:/bin:/sbin"
            seen = [REPOSITORY, home, self.packages, Path(script).resolve().parent, *mounts]
            call = [
                "unshare", "--mount", "--propagation", "private", "sh", "-c", ENTER_CHROOT, "sh", str(self.chroot),
                *dict.fromkeys(str(Path(folder).resolve()) for folder in seen), "--", *call,
            ]  # fmt: skip
        return _run_bounded(call, variables, timeout, capture)


def ensure(name: str) -> Runtime:
    """The runtime of that name, installed first when the cache lacks it. Raises RuntimeUnavailable."""
    if name not in NAMES:
        raise RuntimeUnavailable(f"No runtime is called {name!r}; there are: {', '.join(NAMES)}.")
    _ensure_pytest()
    return _ensure_bpy(name) if name in BPY_VERSIONS else _ensure_blender()


def cache_folder() -> Path:
    """Where runtimes are kept: $QUADLOOM_CACHE or ~/.cache/quadloom."""
    return Path(os.environ.get("QUADLOOM_CACHE", "~/.cache/quadloom")).expanduser().resolve()


def _ensure_bpy(name: str) -> Runtime:
    version = BPY_VERSIONS[name]
    folder = cache_folder() / f"bpy-{version}"
    _ensure_system_libraries()
    with install(folder, gigabytes=2.5) as needed:
        if needed:
            with _timed(f"install bpy {version} into {folder}"):
                subprocess.run([_python_311(), "-m", "venv", folder], check=True)
                python = str(folder / "bin" / "python")
                # bpy 4.2 is built against numpy 1; each bpy names no upper bound, so the bound is ours.
                requirements = [f"bpy=={version}", "numpy<2"]
                pip = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
                subprocess.run([*pip, "--no-cache-dir", *requirements], check=True)
    return Runtime(name, (str(folder / "bin" / "python"),))


def _ensure_blender() -> Runtime:
    own = os.environ.get("QUADLOOM_BLENDER") or shutil.which("blender")
    if own is not None:
        version = _blender_version(own)
        if version >= OLDEST_BLENDER:
            return Runtime("blender", (own,))
        print(f"[blenders] {own} is version {version[0]}.{version[1]}, older than 4.2: not used", flush=True)
    if os.geteuid() != 0:
        raise RuntimeUnavailable(
            "There is no Blender 4.2 or later on the PATH, and making one in a chroot needs root. "
            "Install Blender and name its executable in QUADLOOM_BLENDER, or run this as root."
        )
    folder = cache_folder() / f"debian-{DEBIAN_SUITE}"
    with install(folder, gigabytes=4.0) as needed:
        if needed:
            if shutil.which("mmdebstrap") is None:
                _apt_install(["mmdebstrap"])
            with _timed(f"install Debian {DEBIAN_SUITE}'s Blender into {folder}"):
                call = [
                    "mmdebstrap", "--mode=root", "--variant=apt", "--quiet",
                    f"--include={','.join(CHROOT_PACKAGES)}",
                    "--aptopt=APT::Install-Recommends false",
                    '--aptopt=Acquire::Check-Valid-Until "false"',
                    "--dpkgopt=path-exclude=/usr/share/doc/*",
                    "--dpkgopt=path-exclude=/usr/share/man/*",
                    "--dpkgopt=path-exclude=/usr/share/locale/*",
                    DEBIAN_SUITE, str(folder), _debian_mirror(),
                ]  # fmt: skip
                subprocess.run(call, check=True)
    return Runtime("blender", ("/usr/bin/blender",), chroot=folder)


def _ensure_pytest() -> None:
    folder = cache_folder() / "pytest"
    with install(folder, gigabytes=0.1) as needed:
        if needed:
            with _timed(f"install pytest {PYTEST_VERSION} into {folder}"):
                pip = [_python_311(), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
                subprocess.run([*pip, "--target", folder, f"pytest=={PYTEST_VERSION}"], check=True)


def _ensure_system_libraries() -> None:
    """Installs what bpy is linked to (as root on Debian and its kin), or names it."""
    missing = []
    for library, package in SYSTEM_LIBRARIES.items():
        try:
            ctypes.CDLL(library)
        except OSError:
            missing.append(package)
    if missing:
        _apt_install([*missing, *DRAWING_PACKAGES])


def _apt_install(packages: Sequence[str]) -> None:
    command = f"apt-get install --no-install-recommends {' '.join(packages)}"
    if os.geteuid() != 0 or shutil.which("apt-get") is None:
        raise RuntimeUnavailable(f"Blender needs system packages that are not here. Install them with: {command}")
    with _timed(command):
        environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
        if not any(Path("/var/lib/apt/lists").glob("*Packages*")):
            subprocess.run(["apt-get", "update", "-qq"], check=True, env=environment)
        call = ["apt-get", "install", "-y", "-qq", "--no-install-recommends", *packages]
        subprocess.run(call, check=True, env=environment, stdout=subprocess.DEVNULL)


def _debian_mirror() -> str:
    """The mirror this machine takes Debian from, by its own apt configuration."""
    targets = ["apt-get", "indextargets", "--format", "$(ORIGIN)|$(LABEL)|$(REPO_URI)", "Created-By: Packages"]
    for _ in range(2):
        listed = subprocess.run(targets, check=True, capture_output=True, text=True).stdout
        for line in listed.splitlines():
            origin, label, uri = line.split("|")
            if (origin, label) == ("Debian", "Debian"):
                return uri
        # Slim images come without package lists; the origin is known once they are there.
        subprocess.run(["apt-get", "update", "-qq"], check=True)
    raise RuntimeUnavailable(
        "This machine's apt names no Debian mirror, so Blender cannot be put in a chroot. "
        "Install Blender 4.2 or later and name its executable in QUADLOOM_BLENDER."
    )


def _python_311() -> str:
    if sys.version_info[:2] == (3, 11):
        return sys.executable
    found = shutil.which("python3.11")
    if found is None:
        raise RuntimeUnavailable("The bpy module needs Python 3.11, and there is no python3.11 on the PATH: install it.")
    return found


def _blender_version(executable: str) -> tuple[int, int]:
    printed = subprocess.run([executable, "--version"], capture_output=True, text=True, timeout=60).stdout
    found = re.search(r"Blender (\d+)\.(\d+)", printed)
    if found is None:
        raise RuntimeUnavailable(f"{executable} --version does not print a Blender version.")
    return int(found[1]), int(found[2])


@contextmanager
def install(folder: Path, gigabytes: float) -> Iterator[bool]:
    """Yields whether `folder` must be made. One process at a time; what a failed or killed run left is removed first."""
    stamp = folder.with_name(folder.name + ".ready")
    folder.parent.mkdir(parents=True, exist_ok=True)
    with open(folder.with_name(folder.name + ".lock"), "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if stamp.exists():
            yield False
            return
        if folder.exists():
            shutil.rmtree(folder)
        free = shutil.disk_usage(folder.parent).free / 1e9
        if free < gigabytes:
            raise RuntimeUnavailable(
                f"{folder.parent} has {free:.1f} GB free and {folder.name} needs {gigabytes:.1f} GB. "
                "Free some space or point QUADLOOM_CACHE at another disk."
            )
        yield True
        stamp.touch()


@contextmanager
def _timed(what: str) -> Iterator[None]:
    print(f"[blenders] {what} ...", flush=True)
    start = time.monotonic()
    yield
    print(f"[blenders] done in {time.monotonic() - start:.0f} s", flush=True)


def _run_bounded(
    call: Sequence[str], variables: dict[str, str], timeout: float, capture: bool
) -> subprocess.CompletedProcess[str]:
    # A session of its own, so that a hang is killed with all its children (bpy 4.5 can hang at exit).
    process = subprocess.Popen(
        call, env=variables, text=True, start_new_session=True,
        stdout=subprocess.PIPE if capture else None, stderr=subprocess.STDOUT if capture else None,
    )  # fmt: skip
    try:
        output, _ = process.communicate(timeout=timeout)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        output, _ = process.communicate()
        print(f"[blenders] killed after {timeout:.0f} s: {' '.join(call[-6:])}", flush=True)
    except BaseException:
        os.killpg(process.pid, signal.SIGKILL)
        raise
    return subprocess.CompletedProcess(list(call), process.returncode, output)


def main() -> int:
    """Installs the runtimes named on the command line (all of them by default) and says where each is."""
    parser = argparse.ArgumentParser(description="Install and cache the Blenders that the tests and the demo run in.")
    parser.add_argument("names", nargs="*", default=NAMES, metavar="NAME", help=f"any of: {', '.join(NAMES)}")
    failed = False
    for name in parser.parse_args().names:
        try:
            runtime = ensure(name)
        except RuntimeUnavailable as error:
            print(f"{name}: {error}", file=sys.stderr)
            failed = True
        else:
            print(f"{name}: {runtime.chroot or ''}{runtime.command[0]}")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())

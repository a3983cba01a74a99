"""The build backend of the package: scikit-build-core, and around it what makes its wheel one for other machines.

Before: set-up, which fetches and builds the engines and what all is linked with (setup/portable). After: the engines that are no core
ones become wheels of their own; the licences of all that is inside; the tag that says which machines a wheel is for.
"""

import base64
import contextlib
import csv
import hashlib
import io
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile

try:
    import tomllib
except ModuleNotFoundError:  # before Python 3.11; scikit-build-core needs it there
    import tomli as tomllib

from scikit_build_core import build as _inner

ROOT = pathlib.Path(__file__).resolve().parents[2]

# What every system with glibc and Python has: it stays the system's.
SYSTEM = re.compile(r"^(ld-linux-x86-64|linux-vdso|libc|libm|libdl|librt|libpthread|libresolv|libutil|libgcc_s|libstdc\+\+)\.so")

# The version of glibc that comes with a distribution whose libstdc++ has this version of its symbols.
GLIBC_OF_GLIBCXX = {28: (2, 31), 29: (2, 34), 30: (2, 35), 31: (2, 37), 32: (2, 38), 33: (2, 39)}

# What ends up in our binaries without being linked by its name, by its Debian packages: headers, and what each compiler and C library adds.
HEADERS = ["libc6-dev", "libgcc-12-dev", "libeigen3-dev", "nlohmann-json3-dev", "libcli11-dev", "libboost1.74-dev", "libstdc++-12-dev"]
FONTS = ["fonts-dejavu-core"]

prepare_metadata_for_build_wheel = _inner.prepare_metadata_for_build_wheel


def get_requires_for_build_wheel(config_settings=None):
    return _inner.get_requires_for_build_wheel(config_settings)


def get_requires_for_build_sdist(config_settings=None):
    return _inner.get_requires_for_build_sdist(config_settings)


def build_sdist(sdist_directory, config_settings=None):
    """With the commit in a file: an archive has no history."""
    file = ROOT / "COMMIT"
    done = subprocess.run(["git", "-C", ROOT, "rev-parse", "--short=12", "HEAD"], capture_output=True, text=True, check=False)
    ours = done.returncode == 0 and not file.exists()
    if ours:
        file.write_text(done.stdout)
    try:
        return _inner.build_sdist(sdist_directory, config_settings)
    finally:
        if ours:
            file.unlink()


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    if sys.platform != "linux" or os.uname().machine != "x86_64":
        raise SystemExit(f"assay: the package is built on x86-64 Linux, and this is {os.uname().sysname} {os.uname().machine}")
    subprocess.run(["bash", ROOT / "setup/setup.sh", "--wheel"], check=True)
    # Node.js bundles the page: the system's, or what the set-up fetched
    script = 'root="$1"; source "$1/setup/common.sh"; find_cache && find_node && echo "$PATH"'
    done = subprocess.run(["bash", "-c", script, "-", ROOT], capture_output=True, text=True, check=True)
    os.environ["PATH"] = done.stdout.strip()
    with tempfile.TemporaryDirectory(prefix="assay-wheel-") as work:
        name = _inner.build_wheel(work, config_settings, metadata_directory)
        return finish(pathlib.Path(work, name), pathlib.Path(wheel_directory)).name


# ---- after the build --------------------------------------------------------------------------------------------------


def finish(wheel, out):
    """Writes the finished wheels into the folder `out` and returns the path of the program's."""
    with tempfile.TemporaryDirectory(prefix="assay-unpacked-") as work:
        tree = pathlib.Path(work, "assay")
        with zipfile.ZipFile(wheel) as archive:
            for info in archive.infolist():
                path = pathlib.Path(archive.extract(info, tree))
                if not info.is_dir():
                    path.chmod(0o755 if info.external_attr >> 16 & 0o111 else 0o644)
        information = next(tree.glob("*.dist-info"))
        check_libraries(tree)
        version = wheel.name.split("-")[1]
        for recipe, part in further_engines(tree, pathlib.Path(work)):
            plugins = targets_of(part)
            described = part / f"assay_{recipe.replace('-', '_')}-{version}.dist-info"
            described.mkdir()
            (described / "METADATA").write_text(
                f"Metadata-Version: 2.1\nName: assay-{recipe}\nVersion: {version}\nRequires-Python: >=3.8\nRequires-Dist: assay=={version}\n"
                f"Summary: The physics engine {recipe} for the package assay\n"
                "License: Apache-2.0, and those in licenses/third_party\n")
            shutil.copytree(information / "licenses", described / "licenses")
            (described / "WHEEL").write_text("Wheel-Version: 1.0\nGenerator: assay\nRoot-Is-Purelib: false\n")
            add_licences(described, plugins)
            close(part, described, out)
        add_licences(information, ["assay", "_core", "assay-python-host", *targets_of(tree)], whole=True)
        return close(tree, information, out)


def close(tree, information, out):
    """Adds the tag and the list of files."""
    tag = f"py3-none-manylinux_{'_'.join(map(str, needed_glibc(elf_files(tree))))}_x86_64"
    file = information / "WHEEL"
    lines = [line for line in file.read_text().splitlines() if line and not line.startswith("Tag:")]
    file.write_text("\n".join([*lines, f"Tag: {tag}"]) + "\n")
    write_record(tree, information / "RECORD")
    return pack(tree, out / f"{information.name[: -len('.dist-info')]}-{tag}.whl")


# ---- engines ------------------------------------------------------------------------------------------------------------

PLUGINS = "assay/program/lib/assay/engines"


def recipe_of(engine):
    """The folder of src/engines whose recipe builds the engine, as jolt of jolt-f32; "" where none does."""
    while engine and not (ROOT / "src/engines" / engine / "recipe/build.sh").is_file():
        engine = engine.rpartition("-")[0]
    return engine


def about(recipe):
    """What src/engines/NAME/about.toml says."""
    file = ROOT / "src/engines" / recipe / "about.toml"
    return tomllib.loads(file.read_text()) if file.is_file() else {}


def is_core(recipe):
    return not recipe or about(recipe).get("set_up", "core") == "core"


def further_engines(tree, work):
    """Moves the files of each engine that is set up on request into a tree of its own, and yields (recipe, that tree)."""
    parts = {}
    for path in sorted((tree / PLUGINS).iterdir()):
        recipe = recipe_of(path.name.removeprefix("assay-engine-").split(".")[0])
        if not is_core(recipe):
            target = work / f"engine-{recipe}" / PLUGINS / path.name
            target.parent.mkdir(parents=True, exist_ok=True)
            path.rename(target)
            parts[recipe] = work / f"engine-{recipe}"
    return parts.items()


def targets_of(tree):
    return [path.stem for path in sorted((tree / PLUGINS).glob("assay-engine-*.so"))]


def elf_files(tree):
    found = []
    for path in sorted(tree.rglob("*")):
        if path.is_file() and not path.is_symlink():
            with path.open("rb") as file:
                if file.read(4) == b"\x7fELF":
                    found.append(path)
    return found


def check_libraries(tree):
    """Every shared library that a binary needs is inside or the system's."""
    binaries = elf_files(tree)
    inside = {path.name for path in binaries}
    for binary in binaries:
        said = subprocess.run(["readelf", "-d", "--wide", binary], capture_output=True, text=True, check=True).stdout
        needed = [name for name in re.findall(r"\(NEEDED\)\s+Shared library: \[(.+?)\]", said) if not SYSTEM.match(name)]
        for name in needed:
            if name not in inside:
                raise SystemExit(f"assay: '{binary.relative_to(tree)}' needs '{name}', which other machines need not have")
        if "(RUNPATH)" in said and needed:
            raise SystemExit(f"assay: '{binary.relative_to(tree)}' has a RUNPATH, with which {needed[0]} does not find its libraries")


def needed_glibc(binaries):
    """The oldest glibc with which all of them load, and whose distributions have a libstdc++ that is new enough."""
    newest = (2, 17)
    for binary in binaries:
        said = subprocess.run(["readelf", "-V", "--wide", binary], capture_output=True, text=True, check=True).stdout
        for major, minor in re.findall(r"Name: GLIBC_(\d+)\.(\d+)", said):
            newest = max(newest, (int(major), int(minor)))
        for patch in re.findall(r"Name: GLIBCXX_3\.4\.(\d+)", said):
            if int(patch) >= min(GLIBC_OF_GLIBCXX):
                newest = max(newest, GLIBC_OF_GLIBCXX[int(patch)])
    return newest


# ---- licences -----------------------------------------------------------------------------------------------------------


def package_of(path):
    """The Debian package that a file belongs to."""
    done = subprocess.run(["dpkg", "-S", path], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f"assay: nobody knows the licence of '{path}': it belongs to no package")
    return done.stdout.split(": ")[0].split(",")[0].split(":")[0]


def build_commands(targets):
    return subprocess.run(["ninja", "-C", ROOT / "build/package", "-t", "commands", *targets], capture_output=True, text=True,
                          check=True).stdout


def linked_packages(commands):
    """The Debian packages of the static libraries that are in the binaries, each with its libraries."""
    packages = {}
    for path in sorted({pathlib.Path(each) for each in re.findall(r"/[^\s,]+\.a\b", commands)}):
        if "/engines/portable-" in str(path):
            # compiled from the sources of the package that has the shared one
            packages.setdefault(package_of(f"/usr/lib/x86_64-linux-gnu/{path.stem}.so"), []).append(path.name)
        elif path.is_relative_to("/usr"):
            packages.setdefault(package_of(path), []).append(path.name)
    return packages


def engine_parts(commands):
    """What recipes made and the commands read, as (recipe, folder)."""
    script = 'root="$1"; source "$1/setup/common.sh"; find_cache && engine_folder "$2"'
    for recipe in sorted(ROOT.glob("src/engines/*/recipe/build.sh")):
        name = recipe.parent.parent.name
        done = subprocess.run(["bash", "-c", script, "-", ROOT, name], capture_output=True, text=True, check=True)
        made = pathlib.Path(done.stdout.strip())
        for part in sorted(set(re.findall(rf"{re.escape(str(made))}/([^/\s\"':,]+)", commands))):
            if (made / part).is_dir():
                yield name, made / part


def more_licences(engine, work):
    """Texts that its recipe does not keep beside what it made (`license` of about.toml), as (file, where in the part's folder)."""
    found = []
    for license in about(engine).get("license", []):
        if "file" in license:
            found.append((pathlib.Path(license["file"]), license["as"]))
            continue
        script = 'root="$1"; source "$1/setup/common.sh"; find_cache && download_folder "$2"'
        pins = ROOT / "src/engines" / engine / license["download"]
        done = subprocess.run(["bash", "-c", script, "-", ROOT, pins], capture_output=True, text=True, check=True)
        archives = list(pathlib.Path(done.stdout.strip()).glob(license["archive"]))
        if not archives:
            raise SystemExit(f"assay: the licences of what was compiled into {engine} are not on this machine: remove its folder from the "
                             f"cache's engines, and set-up fetches '{license['archive']}' again")
        with zipfile.ZipFile(archives[0]) as archive:
            names = [name for name in archive.namelist() if re.fullmatch(license["members"], name)]
            found += [(pathlib.Path(archive.extract(name, work)), pathlib.Path(license["as"], name.removeprefix(license["below"] + "/")))
                      for name in names]
    return found


def add_licences(information, targets, whole=False):
    """The text of the licence of everything in these targets, and README.txt, which lists them. A part without one stops the build.
    `whole`: it is the program's wheel, with the page, the fonts and the extension."""
    folder = information / "licenses/third_party"
    listed = []

    def add(name, what, files):
        if not files:
            raise SystemExit(f"assay: the licence of {name} is not on this machine: the package must not be built without it")
        for file, relative in files:
            target = folder / name / relative
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(file, target)
            target.chmod(0o644)
        listed.append(f"{name}\n    {what}\n    texts: {', '.join(sorted(str(relative) for _, relative in files))}")

    commands = build_commands(targets)
    for engine, made in engine_parts(commands):
        files = [(path, path.name) for path in made.iterdir() if path.is_file() and re.match(r"(?i)licen[cs]e|copying|notice", path.name)]
        if (made / "licenses").is_dir():
            files += [(path, path.relative_to(made / "licenses")) for path in (made / "licenses").rglob("*") if path.is_file()]
        with tempfile.TemporaryDirectory(prefix="assay-licences-") as work:
            more = more_licences(engine, work)
            add(made.name, f"engine {engine}: {(made / 'build.txt').read_text().splitlines()[0].removeprefix('source=')}", files + more if files else [])
    packages = linked_packages(commands) | {name: ["compiled in"] for name in HEADERS}
    if whole:
        packages |= {name: ["DejaVu Sans"] for name in FONTS}
    for name, libraries in sorted(packages.items()):
        source = subprocess.run(["dpkg-query", "-W", "-f", "${source:Package} ${source:Version}", name], capture_output=True,
                                text=True, check=True).stdout
        text = pathlib.Path("/usr/share/doc", name, "copyright")
        add(name, f"{', '.join(libraries)}; Debian's source package {source} (https://snapshot.debian.org)",
            [(text, "copyright")] if text.is_file() else [])
    if whole:
        add_page_and_extension(add)
    head = ("What is inside this package besides assay, with the texts of its licences in the folders of these names.\n"
            "Nothing that may not be redistributed is inside; CoACD and ONNX Runtime are fetched when assay.fetch() is called.\n\n")
    (folder / "README.txt").write_text(head + "\n".join(listed) + "\n")


def add_page_and_extension(add):
    dependencies = json.loads((ROOT / "web/package.json").read_text())["dependencies"]
    for name in sorted(page_packages([each for each in dependencies if each != "esbuild"])):
        made = ROOT / "web/node_modules" / name
        add(f"npm-{name}", f"part of every report; version {json.loads((made / 'package.json').read_text())['version']}",
            [(path, path.name) for path in made.iterdir() if re.match(r"(?i)licen[cs]e", path.name)])
    import nanobind

    made = pathlib.Path(nanobind.__file__).parent
    distribution = next(made.parent.glob("nanobind-*.dist-info"))
    add("nanobind", f"compiled in; {distribution.name}; in it robin-map (MIT)",
        [*((path, path.name) for path in distribution.rglob("LICENSE*") if path.is_file()),
         # whose text begins each of its headers
         (made / "ext/robin_map/include/tsl/robin_map.h", "robin_map.h")])


def page_packages(names):
    """With what they need themselves."""
    found, open_ = set(), list(names)
    while open_:
        name = open_.pop()
        if name in found:
            continue
        found.add(name)
        manifest = json.loads((ROOT / "web/node_modules" / name / "package.json").read_text())
        open_ += manifest.get("dependencies", {})
    return found


# ---- the archive ---------------------------------------------------------------------------------------------------------


def write_record(tree, record):
    rows = []
    for path in sorted(tree.rglob("*")):
        if path.is_file() and path != record:
            digest = base64.urlsafe_b64encode(hashlib.sha256(path.read_bytes()).digest()).rstrip(b"=").decode()
            rows.append((path.relative_to(tree).as_posix(), f"sha256={digest}", path.stat().st_size))
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([*rows, (record.relative_to(tree).as_posix(), "", "")])
    record.write_text(text.getvalue())


def pack(tree, wheel):
    with contextlib.suppress(FileNotFoundError):
        wheel.unlink()
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        # metadata last, as wheels have it
        for path in sorted((path for path in tree.rglob("*") if path.is_file()),
                           key=lambda path: (".dist-info" in path.relative_to(tree).parts[0], path)):
            info = zipfile.ZipInfo(path.relative_to(tree).as_posix(), (2020, 1, 1, 0, 0, 0))
            info.external_attr = (0o100000 | path.stat().st_mode & 0o777) << 16
            info.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(info, path.read_bytes())
    return wheel

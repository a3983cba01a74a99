"""The wheel: what is inside, for which machines it is, and under which licences."""

import importlib.metadata
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tarfile
import zipfile

import assay
import pytest
from assay import _fetch
from assay._program import FOLDER, program
from conftest import SOURCE

WHEEL = pathlib.Path(os.environ.get("ASSAY_WHEEL", "/nowhere"))
needs_wheel = pytest.mark.skipif(not WHEEL.is_file(), reason="ASSAY_WHEEL names no wheel: ./test --package does")


def binaries():
    found = []
    for path in FOLDER.rglob("*"):
        if path.is_file():
            with path.open("rb") as file:
                if file.read(4) == b"\x7fELF":
                    found.append(path)
    return found


def test_every_library_is_inside_or_the_systems():
    assert len(binaries()) >= 9  # the program, the extension, two libraries, the host and four plugins
    for binary in binaries():
        said = subprocess.run(["ldd", binary], capture_output=True, text=True, check=False).stdout
        assert "not found" not in said, binary
        for name, path in re.findall(r"(\S+) => (/\S+)", said):
            system = re.match(r"(libc|libm|libdl|librt|libpthread|libgcc_s|libstdc\+\+|libresolv|libutil)\.so", name)
            assert system or FOLDER in pathlib.Path(path).resolve().parents, f"{binary}: {name} is {path}"


def licences():
    files = importlib.metadata.files("assay")
    return {str(each).split("licenses/third_party/")[1]: each.locate() for each in files if "licenses/third_party/" in str(each)}


def test_every_part_has_its_licence():
    texts = licences()
    listed = pathlib.Path(texts["README.txt"]).read_text()
    inside = {path.name for path in (FOLDER / "program/lib/assay").glob("*.so*")}
    assert inside == {"libmujoco.so.4.0.1", "libpython3.11.so.1.0"}
    for library, package in (("libcairo.a", "libcairo2-dev"), ("libfmt.a", "libfmt-dev"), ("libsqlite3.a", "libsqlite3-dev"),
                             ("libpython3.11-pic.a", "libpython3.11-dev")):
        assert library in listed
        assert f"{package}/copyright" in texts, library
    plugins = {path.stem for path in (FOLDER / "program/lib/assay/engines").glob("assay-engine-*.so")}
    assert plugins - {"assay-engine-null", "assay-engine-skeleton"} == {"assay-engine-mujoco", "assay-engine-bullet-f64", "assay-engine-ode"}
    for engine in ("mujoco", "bullet", "ode"):
        assert any(name.startswith(f"{engine}-") and pathlib.Path(path).stat().st_size > 100 for name, path in texts.items()), engine
    for name in ("npm-three", "npm-d3-scale", "nanobind", "fonts-dejavu-core", "libeigen3-dev"):
        assert any(text.startswith(f"{name}/") for text in texts), name
    for name in ("LICENSE", "THIRD_PARTY.md"):
        assert any(str(each).endswith(f"licenses/{name}") for each in importlib.metadata.files("assay"))
    # fetched on request, not inside; nor are engines whose environments a clone makes
    assert not list(FOLDER.rglob("environment.txt"))
    assert not [path for path in FOLDER.rglob("*") if "coacd" in path.name or "onnxruntime" in path.name]


def test_what_is_fetched_is_pinned():
    pins = (FOLDER / "libraries.txt").read_text()
    assert re.search(r"^coacd==\S+ --hash=sha256:[0-9a-f]{64}$", pins, re.MULTILINE)
    assert re.search(r"^onnxruntime==\S+ --hash=sha256:[0-9a-f]{64}$", pins, re.MULTILINE)
    with pytest.raises(assay.InputError, match="there is no 'robots' to fetch"):
        assay.fetch("robots")
    assert _fetch.cache() == pathlib.Path(os.environ["XDG_CACHE_HOME"]) / "assay"


def test_no_network_and_no_writable_folder_are_one_sentence(tmp_path, monkeypatch):
    monkeypatch.setenv("ASSAY_CACHE", str(tmp_path))
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.delenv("PIP_FIND_LINKS", raising=False)
    with pytest.raises(assay.MachineError, match=r"^coacd \S+ cannot be fetched from the Python package index: is there a network.* No matching") as raised:
        assay.fetch()
    assert "\n" not in str(raised.value)
    (tmp_path / "libraries").rmdir()
    (tmp_path / "libraries").write_text("a file in its place")
    with pytest.raises(assay.MachineError, match=r"^cannot write to '.*/libraries' \(.*\): set ASSAY_CACHE to a folder of yours$"):
        assay.fetch()


@needs_wheel
def test_the_tag_is_what_the_binaries_need():
    tag = re.fullmatch(r"assay-[\d.]+-py3-none-manylinux_(\d+)_(\d+)_x86_64\.whl", WHEEL.name)
    assert tag, WHEEL.name
    needed = (2, 0)
    for binary in binaries():
        said = subprocess.run(["readelf", "-V", "--wide", binary], capture_output=True, text=True, check=True).stdout
        for version in re.findall(r"GLIBC_(\d+)\.(\d+)", said):
            needed = max(needed, tuple(map(int, version)))
    assert needed <= (int(tag[1]), int(tag[2]))
    assert int(tag[2]) <= 31, "Debian 11 and Ubuntu 20.04 have glibc 2.31"
    inside = importlib.metadata.distribution("assay").read_text("WHEEL")
    assert f"Tag: py3-none-manylinux_{tag[1]}_{tag[2]}_x86_64" in inside


# what engines bring themselves: Havok is MIT's, and parts of other people are in plugins
TEXTS = {"havok": [("havok-1.3.14/havok.txt", "MIT License")],
         "rapier": [("rapier-0.36.1/rapier-parry-and-rust-std/APACHE-2.0.txt", "Apache")],
         "dart": [("libassimp-dev/copyright", "Assimp"), ("ode-0.16.6/", "")],
         "jolt-wasm": [("jolt-5.6.0-wasm/zig/libc/wasi/libc-top-half/musl/COPYRIGHT", "Rich Felker"),
                       ("jolt-5.6.0-wasm/zig/libcxx/LICENSE.TXT", "LLVM")]}
FURTHER = sorted(WHEEL.parent.glob("assay_*.whl")) if WHEEL.is_file() else []


@needs_wheel
@pytest.mark.parametrize("wheel", FURTHER, ids=lambda wheel: wheel.name.split("-")[0])
def test_an_engine_that_is_set_up_on_request_has_a_wheel_of_its_own(wheel, tmp_path):
    shutil.copytree(FOLDER, tmp_path / "assay")
    assert wheel.name.split("-", 1)[1] == WHEEL.name.split("-", 1)[1]  # of the same version, for the same machines
    recipe = wheel.name.split("-")[0].removeprefix("assay_").replace("_", "-")
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        assert not [name for name in names if (tmp_path / name).exists()], "a file of the program's wheel"
        archive.extractall(tmp_path)
    information = next(tmp_path.glob("*.dist-info"))
    assert f"Name: assay-{recipe}\n" in (information / "METADATA").read_text()
    assert f"Requires-Dist: assay=={importlib.metadata.version('assay')}\n" in (information / "METADATA").read_text()
    texts = information / "licenses/third_party"
    assert any(path.name.startswith(re.match("[a-z]+", recipe)[0]) for path in texts.iterdir())
    for name, said in TEXTS.get(recipe, []):
        files = [texts / name] if not name.endswith("/") else [path for path in (texts / name).rglob("*") if path.is_file()]
        assert files and all(said in path.read_text(encoding="utf-8") for path in files), name
    added = {path.stem.removeprefix("assay-engine-") for path in map(pathlib.PurePath, names) if path.suffix == ".so"}
    done = subprocess.run([tmp_path / "assay/program/bin/assay", "engines", "--json"], capture_output=True, text=True, check=True)
    found = {each["engine"] for each in json.loads(done.stdout)["contenders"]}
    assert added and added - {"havok-node"} <= found  # which is absent without Node


def refusal(*options):
    """What pip says before it downloads."""
    done = subprocess.run([sys.executable, "-m", "pip", "download", "--no-index", "--find-links", WHEEL.parent, "--no-deps",
                           "--only-binary", ":all:", *options, "-d", os.devnull + "-never", "assay"],
                          capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


@needs_wheel
def test_pip_takes_it_for_every_python_and_refuses_an_older_libc(tmp_path):
    for options in (["--python-version", "3.7"], ["--platform", "manylinux_2_17_x86_64"], ["--platform", "musllinux_1_2_x86_64"],
                    ["--platform", "macosx_14_0_arm64"]):
        status, said = refusal("--python-version", "3.11", *options)
        assert status != 0 and ("No matching distribution" in said or "requires a different Python" in said), said
    tag = WHEEL.name.removesuffix(".whl").split("-")[-1]
    for version in ("3.8", "3.10", "3.11", "3.13"):
        assert refusal("--python-version", version, "--platform", tag, "-d", str(tmp_path / version))[0] == 0


@needs_wheel
def test_the_wheel_is_small_enough():
    assert WHEEL.stat().st_size < 150e6
    with zipfile.ZipFile(WHEEL) as archive:
        assert archive.testzip() is None
        mode = archive.getinfo("assay/program/bin/assay").external_attr >> 16
    assert mode & 0o111 and os.access(program(), os.X_OK)


@pytest.mark.skipif(not (SOURCE / ".git").exists(), reason="the tests are not in a clone")
def test_the_source_archive_has_every_source(tmp_path):
    """`python -m build` makes the wheel from the archive, and not from the clone."""
    folders = ["CMakeLists.txt", "cmake", "setup", "src", "web", "models", "campaigns", "python"]
    done = subprocess.run(["git", "-C", SOURCE, "ls-files", "-z", *folders], capture_output=True, text=True, check=True)
    made = subprocess.run([sys.executable, "-m", "build", "--sdist", "--no-isolation", "--outdir", tmp_path, SOURCE],
                          capture_output=True, text=True, check=False)
    assert made.returncode == 0, made.stderr
    with tarfile.open(next(tmp_path.glob("*.tar.gz"))) as archive:
        inside = {name.split("/", 1)[-1] for name in archive.getnames()}
    assert "COMMIT" in inside
    assert {name for name in done.stdout.split("\0") if name} - inside == set()

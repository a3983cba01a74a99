"""What an import costs, and what the package says of itself."""

import ast
import subprocess
import sys

import assay
from assay import _core
from conftest import SOURCE


def python(code):
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip()


def test_an_import_loads_neither_the_extension_nor_numpy():
    loaded = python("import sys, assay; print(*sorted(set(sys.modules)))").split()
    assert "assay" in loaded
    assert not {"numpy", "assay._core", "pandas", "matplotlib"} & set(loaded)


def test_every_name_is_there():
    for name in assay.__all__:
        assert getattr(assay, name) is not None
        assert name in dir(assay)
    assert not hasattr(assay, "simulate")


def test_imports_point_one_way():
    folder = SOURCE / "python/assay"
    modules = {path.stem for path in folder.glob("*.py")} - {"__init__"}

    def imported(module):
        """Also what is imported when a function is called."""
        found = set()
        for each in ast.walk(ast.parse((folder / f"{module}.py").read_text("utf-8"))):
            if isinstance(each, ast.ImportFrom) and each.level == 1:
                found |= {each.module} if each.module else {alias.name for alias in each.names}
        return found & modules

    above, left = [], {module: imported(module) for module in modules}
    assert left["_program"] >= {"errors", "_plugins"}
    while left:
        free = [module for module, needs in left.items() if needs <= set(above)]
        assert free, f"these import each other: {left}"
        above += free
        left = {module: needs for module, needs in left.items() if module not in free}


def test_the_version_is_the_programs():
    from assay._program import call

    assert call("--version").strip() == f"assay {assay.__version__} ({assay.__commit__})"


def test_stubs_name_what_the_extension_has():
    tree = ast.parse((SOURCE / "python/assay/_core.pyi").read_text())

    def names(body):
        found = set()
        for each in body:
            if isinstance(each, (ast.FunctionDef, ast.ClassDef)):
                found.add(each.name)
            elif isinstance(each, ast.AnnAssign):
                found.add(each.target.id)
        return found

    assert names(tree.body) == {name for name in vars(_core) if not name.startswith("__")}
    for each in tree.body:
        if isinstance(each, ast.ClassDef):
            made = {name for name in vars(getattr(_core, each.name)) if not name.startswith("__")}
            assert names(each.body) - {"__init__"} == made, each.name


def test_public_names_are_documented():
    for name in assay.__all__:
        assert (getattr(assay, name).__doc__ or "").strip(), name
    for kind in (assay.Model, assay.Simulation, assay.Results, assay.Comparison):
        for name, member in vars(kind).items():
            if not name.startswith("_") and (callable(member) or isinstance(member, property)):
                assert (member.__doc__ or "").strip() or name in ("initial",), f"{kind.__name__}.{name}"


def test_engines_of_a_clone_are_named_with_the_way_to_them():
    absent = {each["engine"]: each["reason"] for each in assay.engines()["absent"]}
    for name in ("drake", "dartpy", "superdex", "mujoco-warp", "mjx"):
        assert f"./assay setup {name}" in absent[name] and "clone" in absent[name]

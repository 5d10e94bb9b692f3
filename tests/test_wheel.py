"""The wheel holds the three packages, the command and nothing else."""

import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from zipfile import ZipFile

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("symfric", "ocp", "identification")
missing = [name for name in ("build", "hatchling") if find_spec(name) is None]

pytestmark = pytest.mark.skipif(
    bool(missing), reason=f"needs {', '.join(missing)} to build a wheel"
)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> ZipFile:
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(folder)]
    run = subprocess.run([*command, str(ROOT)], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout + run.stderr
    (path,) = folder.glob("symfric-*-py3-none-any.whl")
    return ZipFile(path)


def metadata(wheel: ZipFile, name: str) -> str:
    (path,) = [n for n in wheel.namelist() if n.endswith(f".dist-info/{name}")]
    return wheel.read(path).decode()


def test_it_holds_the_three_packages_alone(wheel: ZipFile) -> None:
    tops = {name.split("/")[0] for name in wheel.namelist()}
    assert {top for top in tops if not top.endswith(".dist-info")} == set(PACKAGES)


@pytest.mark.parametrize("package", PACKAGES)
def test_it_holds_every_module_of_a_package(wheel: ZipFile, package: str) -> None:
    sources = {p.relative_to(ROOT).as_posix() for p in (ROOT / package).rglob("*.py")}
    held = {n for n in wheel.namelist() if n.startswith(f"{package}/") and n.endswith(".py")}
    assert sources <= held
    assert not [n for n in held if "test" in n]


@pytest.mark.parametrize(
    "name",
    [
        *(f"{p}/py.typed" for p in PACKAGES),
        "symfric/CONVENTIONS.md",
        "symfric/emitter/functions.js",
    ],
)
def test_it_holds_what_is_not_code(wheel: ZipFile, name: str) -> None:
    assert name in wheel.namelist()


def test_it_asks_for_these_libraries_only(wheel: ZipFile) -> None:
    lines = metadata(wheel, "METADATA").splitlines()
    needed = {
        line.split(":")[1].split(">")[0].strip()
        for line in lines
        if line.startswith("Requires-Dist:") and "extra ==" not in line
    }
    assert needed == {"casadi", "numpy", "scipy", "matplotlib", "typer", "rich"}


def test_it_cannot_be_uploaded_by_accident_and_installs_the_command(wheel: ZipFile) -> None:
    assert "Classifier: Private :: Do Not Upload" in metadata(wheel, "METADATA")
    assert "symfric = symfric.__main__:main" in metadata(wheel, "entry_points.txt")

"""FMUs are code: which ones a running server takes from a scenario that a client has it load."""

import os
import shutil
from pathlib import Path

import pytest

import takt
from takt.server import program_path

FMU = Path(program_path("takt-server")).resolve().parents[1] / "fmus" / "rotor.fmu"


def cell_with(fmu):
    return f"takt_scenario: 1\nname: rotor\nsolver: {{step_s: 0.001}}\nfmus: {{Rotor: {{file: {fmu}}}}}\n"


@pytest.fixture
def folders(tmp_path):
    """Of scenarios; of FMUs that run and of others, each with the same FMU."""
    made = {name: tmp_path / name for name in ("cells", "allowed", "other")}
    for folder in made.values():
        folder.mkdir()
    for name in ("allowed", "other"):
        shutil.copy(FMU, made[name])
    os.symlink(made["other"] / "rotor.fmu", made["allowed"] / "link.fmu")
    return made


def scenario(folders, name, fmu):
    file = folders["cells"] / f"{name}.yaml"
    file.write_text(cell_with(fmu))
    return str(file)


def test_a_client_loads_scenarios_whose_fmus_are_below_the_directory(folders):
    inside = scenario(folders, "inside", folders["allowed"] / "rotor.fmu")
    with takt.Server(options=["--allow-fmus", str(folders["allowed"])]) as server, server.client() as cell:
        cell.load_scenario(inside)
        assert "Rotor" in cell.info.devices
        for name, fmu in (("other", folders["other"] / "rotor.fmu"), ("link", folders["allowed"] / "link.fmu"),
                          ("upwards", folders["allowed"] / ".." / "other" / "rotor.fmu")):
            with pytest.raises(takt.CellError) as refused:
                cell.load_scenario(scenario(folders, name, fmu))
            for word in (f"{name}.yaml:4", "fmus.Rotor.file", str(fmu), "allowed: FMUs below the directory of --allow-fmus",
                         str(folders["allowed"])):
                assert word in str(refused.value), refused.value
            assert "Rotor" in cell.info.devices, "the cell stays"


def test_without_the_option_a_client_loads_none(folders):
    with takt.Server() as server, server.client() as cell, pytest.raises(takt.CellError) as refused:
        cell.load_scenario(scenario(folders, "inside", folders["allowed"] / "rotor.fmu"))
    assert "--allow-fmus DIR" in str(refused.value)

"""`surface intersect`: rays from flags and from a file."""

import json
from pathlib import Path

import numpy as np
import pytest

from service.cli.main import main

RAYS = np.array([[0.1, 0.2, 5, 0, 0, -2], [3, 0, 0, -1, 0, 0]])


def test_rays_from_flags_and_from_a_file(
    tmp_path: Path, capsysbinary: pytest.CaptureFixture[bytes]
) -> None:
    np.save(tmp_path / "rays.npy", RAYS)
    flags = ["--all", "--relative-thickness", "1e-8", "-o", "-"]
    rays = [word for row in RAYS.tolist() for word in ("--ray", ",".join(map(repr, row)))]
    assert main(["intersect", "sphere", *rays, *flags]) == 0
    output = capsysbinary.readouterr().out
    assert main(["intersect", "sphere", "--rays", str(tmp_path / "rays.npy"), *flags]) == 0
    assert capsysbinary.readouterr().out == output
    # The first ray meets the unit sphere at these heights, ±; its direction has the length 2.
    height = (1 - 0.1**2 - 0.2**2) ** 0.5
    expected = [(5 - height) / 2, (5 + height) / 2, 2, 4]
    assert json.loads(output)["t"] == pytest.approx(expected)


def test_a_ray_of_five_numbers_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["intersect", "sphere", "--ray", "0,0,5,0,0", "-o", "-"]) == 1
    assert "six numbers" in capsys.readouterr().err

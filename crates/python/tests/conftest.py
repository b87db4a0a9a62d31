"""Records that several tests use."""

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="session")
def samples() -> Path:
    return ROOT / "sample_data"


@pytest.fixture(scope="session")
def program() -> str:
    """The commands, whose figures those of the package are held against."""
    program = os.environ.get("SINDYSCOPE")
    if not program:
        pytest.skip("the environment's SINDYSCOPE names no program to compare with")
    return program


@pytest.fixture(scope="session")
def arrays(samples: Path):
    """Time, displacement and input of the Duffing record."""
    import numpy as np

    lines = [line for line in open(samples / "duffing.csv") if line[0].isdigit() or line[0] == "-"]
    return np.loadtxt(lines, delimiter=",", unpack=True)

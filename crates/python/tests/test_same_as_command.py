"""The figures are those of the command, to the last digit of the JSON."""

import json
import subprocess

import pytest

import sindyscope

TIMES = ("elapsed_ms",)


def told(program, *words):
    done = subprocess.run([program, *map(str, words), "--json", "-"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def timeless(value):
    """Without what a clock decides; numbers as the text that they were."""
    if isinstance(value, dict):
        return {key: timeless(v) for key, v in value.items() if key not in TIMES}
    return [timeless(v) for v in value] if isinstance(value, list) else value


def same(one, other):
    # A dict of floats compares by value, NaN never stands in JSON, and the order of the fields is part of the promise.
    assert json.dumps(timeless(one)) == json.dumps(timeless(other))


@pytest.mark.parametrize(
    ("file", "test", "settings", "options"),
    [
        ("friction_noisy.csv", "friction_noisy_test.csv", {}, []),
        (
            "friction_noisy.csv",
            "friction_noisy_test.csv",
            {"constrain": "x=-u, v=-du, passive", "mass": 2, "refine": True},
            ["--constrain", "x=-u, v=-du, passive", "--mass", "2", "--refine"],
        ),
        ("duffing.csv", None, {"crop": (5, None), "hold_out": 0.3}, ["--crop", "5:", "--hold-out", "0.3"]),
        (
            "duffing.csv",
            "duffing_test.csv",
            {"terms": ["x", "v", "u", "x^3"], "window": 31, "order": 5, "threshold": 0.02, "fix": {"v": -0.1}},
            ["--terms", "x, v, u, x^3", "--window", "31", "--order", "5", "--threshold", "0.02", "--fix", "v=-0.1"],
        ),
        (
            "lorenz.csv",
            None,
            {"kind": "first-order", "window": 21, "order": 5, "threshold": 0.02},
            ["--kind", "first-order", "--window", "21", "--order", "5", "--threshold", "0.02"],
        ),
    ],
)
def test_identify(program, samples, file, test, settings, options):
    held_out = [] if test is None else ["--test", samples / test]
    command = told(program, "identify", samples / file, *held_out, *options)
    found = sindyscope.identify(samples / file, test=None if test is None else samples / test, **settings)
    same(found.to_dict(), command)
    again = sindyscope.identify(
        sindyscope.read(samples / file, **{k: v for k, v in settings.items() if k == "kind"}),
        test=None if test is None else sindyscope.read(samples / test),
        **settings,
    )
    same(again.to_dict(), command)


def test_arrays_give_what_their_file_gives(program, samples, arrays):
    command = told(program, "identify", samples / "duffing.csv", "--window", "31", "--order", "5", "--threshold", "0.02")
    t, x, u = arrays
    units = sindyscope.read(samples / "duffing.csv")[0].units
    found = sindyscope.identify(t, x, u, name="duffing", units={"x": units["x1"], "u": units["u1"]}, window=31, order=5, threshold=0.02)
    same(found.to_dict()["equations"], command["equations"])
    same(found.to_dict()["train"], command["train"])
    same(found.to_dict()["records"], command["records"])


def test_diagnose(program, samples):
    words = ["diagnose", samples / "friction_decay.csv", "--max-effects", "1"]
    command = told(program, *words)
    found = sindyscope.diagnose(samples / "friction_decay.csv", max_effects=1)
    same(found.to_dict(), command)
    printed = subprocess.run([program, *map(str, words)], capture_output=True, text=True).stdout
    assert str(found).splitlines()[0] == printed.splitlines()[0]


def test_effects(program):
    done = subprocess.run([program, "effects", "--json"], capture_output=True, text=True)
    same(sindyscope.effects(), json.loads(done.stdout))


def test_the_rig_makes_the_same_records(program, tmp_path):
    cases = [
        ("duffing", {"seed": 3, "noise": "1%", "duration": 5}, ["--seed", "3", "--noise", "1%", "--duration", "5"]),
        ("hidden", {"seed": 7, "effect": "coulomb_friction"}, ["--seed", "7", "--effect", "coulomb_friction"]),
    ]
    for scenario, options, words in cases:
        theirs, ours = tmp_path / "theirs.csv", tmp_path / "ours.csv"
        subprocess.run([program, "generate", scenario, "--out", theirs, *words], check=True, capture_output=True)
        sindyscope.generate(scenario, ours, **options)
        assert ours.read_text() == theirs.read_text()


def test_the_report_is_the_same_but_for_the_command_in_it(program, samples, tmp_path):
    theirs, ours = tmp_path / "theirs.html", tmp_path / "ours.html"
    words = [samples / "duffing.csv", "--terms", "x, v, u, x^3", "--window", "31", "--order", "5", "--threshold", "0.02"]
    words += ["--sections", "equation, parameters, response"]
    subprocess.run([program, "report", *map(str, words), "--out", theirs], check=True, capture_output=True)
    sindyscope.report(
        samples / "duffing.csv",
        out=ours,
        sections="equation, parameters, response",
        terms="x, v, u, x^3",
        window=31,
        order=5,
        threshold=0.02,
    )
    assert ours.read_text() == theirs.read_text()


def test_errors_have_the_sentences_of_the_command(program, samples, tmp_path):
    bad = tmp_path / "bad.csv"
    bad.write_text("t,x\n0,1\n0.1,oops\n")
    for file, options, settings in [
        (bad, [], {}),
        (tmp_path / "gone.csv", [], {}),
        (samples / "duffing.csv", ["--terms", "x, x2"], {"terms": "x, x2"}),
        (samples / "duffing.csv", ["--constrain", "u=1/m"], {"constrain": "u=1/m"}),
    ]:
        done = subprocess.run([program, "identify", str(file), *options], capture_output=True, text=True)
        assert done.returncode == 1
        reason = done.stderr.splitlines()[0].removeprefix("sindyscope: ")
        with pytest.raises(sindyscope.Error) as caught:
            sindyscope.identify(file, **settings)
        assert "; ".join(caught.value.args[0].splitlines()) == reason
        assert "--" not in caught.value.args[1]


def test_modes_of_a_structure(program, tmp_path):
    import numpy as np

    # Two masses on springs, swinging freely; their accelerations.
    t = np.arange(0.0, 20.0, 0.01)
    random = np.random.default_rng(2)
    motion = [np.exp(-0.15 * t) * np.cos(2 * np.pi * f * t) for f in (1.5, 4.0)]
    a = np.stack([motion[0] + motion[1], 1.6 * motion[0] - 0.6 * motion[1]], 1) + 0.01 * random.normal(size=(len(t), 2))
    file = tmp_path / "structure.csv"
    np.savetxt(file, np.column_stack([t, a]), delimiter=",", header="t,a1,a2", comments="", fmt="%.17g")
    command = told(program, "identify", file, "--base", "modes")
    found = sindyscope.modes(file)
    same(found.to_dict(), command)
    assert np.allclose(found.frequencies, [1.5, 4.0], rtol=1e-3) and found.shapes.shape == (2, 2)
    assert "Frequency" in str(found) and found.verdict is None
    # From arrays, and as many as were asked for.
    assert len(sindyscope.modes(t, a=a, number=1).frequencies) == 1
    missing = sindyscope.modes(file, missing=True)
    same(missing.to_dict(), told(program, "diagnose", file, "--base", "modes"))
    assert missing.verdict == "nothing_missing" and missing.missing == []
    with pytest.raises(sindyscope.Error, match="one mode at least"):
        sindyscope.modes(file, number=0)
    # As many as the data bear, and from poles chosen by hand: as text, as pairs, also as the base of a search.
    same(sindyscope.modes(file, number="auto").to_dict(), command)
    chosen = told(program, "identify", file, "--base", "modes", "--poles", "1.4:0.02")
    for poles in ("1.4:0.02", [(1.4, 0.02)], np.array([[1.4, 0.02]])):
        same(sindyscope.modes(file, poles=poles).to_dict(), chosen)
    both = sindyscope.modes(file, poles=[(1.4, 0.02), (4.1, 0.01)], missing=True)
    assert both.verdict == "nothing_missing" and np.allclose(both.frequencies, [1.5, 4.0], rtol=1e-3)
    with pytest.raises(sindyscope.Error, match="damping ratio"):
        sindyscope.modes(file, poles="1.4")
    with pytest.raises(sindyscope.Error, match="every pole stands for one mode"):
        sindyscope.modes(file, number=2, poles="1.4:0.02")
    with pytest.raises(sindyscope.Error, match="whole number"):
        sindyscope.modes(file, number="many")

"""The Python package against the programs of this build: GAPFARM names them, by ctest."""

import concurrent.futures
import contextlib
import inspect
import json
import os
import pathlib
import pickle
import re
import sqlite3
import subprocess
import sys
import typing

import numpy as np
import pandas as pd
import pytest

import gapfarm

ROOT = pathlib.Path(__file__).parents[2]
DEMO = ROOT / "configs" / "demo.toml"
LOG = ROOT / "configs" / "demo" / "trials.csv"


@pytest.fixture(scope="session")
def printed():
    return []


@pytest.fixture(scope="session")
def run(tmp_path_factory, printed):
    folder = tmp_path_factory.mktemp("run") / "demo"
    return gapfarm.evolve(
        DEMO, folder, "--generations", "3", "--population", "8", "--workers", "1",
        progress=printed.append,
    )


def test_evolve_reports_its_progress(run, printed):
    assert any("evolving 7 parameters" in line for line in printed)
    assert run.status()["state"] == "finished"


def test_generations_are_those_of_the_store(run):
    generations = run.generations
    assert list(generations.index) == [1, 2, 3]
    assert (generations.best >= generations["median"]).all()
    assert generations.best.is_monotonic_increasing
    assert generations.attrs["units"]["best"] == "nats/trial"
    assert run.info["seed"] == 1 and run.info["higher_is_better"] is True
    assert run.incidents.empty


def test_individuals_have_parameters_and_genomes(run):
    last = run.individuals()
    assert len(last) == 8 and list(last["rank"]) == list(range(8))
    assert last.friction.between(0.1, 1.5).all()
    assert len(run.individuals(0)) == 24
    genomes = run.genomes()
    assert genomes.shape == (8, 7) and genomes.dtype == np.float64
    best = run.generations.best.idxmax()  # a numpy integer
    assert len(run.individuals(best)) == 8 and run.genomes(best).shape == (8, 7)
    for of in (run.individuals, run.genomes):
        with pytest.raises(ValueError, match="no generation 9, its last is 3"):
            of(9)
    assert ((genomes >= 0) & (genomes <= 1)).all()
    assert run.best.fitness == run.generations.best.iloc[-1]


def test_importance_has_a_row_a_gene(run):
    assert run.importance.shape == (7, 1)
    assert run.importance.isna().all().all()  # 24 evaluations show too little


def test_the_model_holds_the_best(run):
    assert run.model.parameters["full_speed"] == pytest.approx(run.best.full_speed, rel=1e-12)
    assert run.model.parameters["robot"] == "treads"


def test_predictions_of_a_table_and_of_its_file_agree(run):
    trials = gapfarm.read_trials(LOG)
    assert trials.attrs["units"]["x0"] == "m"
    by_file = run.model.predict(LOG, workers=1)
    by_table = run.model.predict(trials, workers=1)
    pd.testing.assert_frame_equal(by_file, by_table)
    assert len(by_file) == len(trials)
    covariances = gapfarm.Model.covariances(by_file)
    assert covariances.shape == (len(trials), 3, 3)
    assert (np.linalg.eigvalsh(covariances) > 0).all()
    assert by_file.log_score.mean() == pytest.approx(run.best.fitness, abs=1e-6)


def test_a_simulated_log_follows_its_seed(run, tmp_path):
    words = ("--sessions", "1", "--trials", "5", "--workers", "1")
    first = run.model.simulate(*words, seed=3)
    pd.testing.assert_frame_equal(first, run.model.simulate(*words, seed=3))
    assert not first.x1.equals(run.model.simulate(*words, seed=4).x1)
    gapfarm.write_trials(first, tmp_path / "log.csv")
    again = gapfarm.read_trials(tmp_path / "log.csv")
    np.testing.assert_array_equal(first.theta1, again.theta1)


def test_errors_are_gapfarms_own(tmp_path, monkeypatch):
    with pytest.raises(gapfarm.GapfarmError, match="none.toml") as error:
        gapfarm.evolve(tmp_path / "none.toml", tmp_path / "run")
    assert error.value.exit_code == 2
    assert pickle.loads(pickle.dumps(error.value)).exit_code == 2
    # One log may stand alone.
    with pytest.raises(gapfarm.GapfarmError, match="none.csv"):
        gapfarm.evolve(DEMO, tmp_path / "run", trials=str(tmp_path / "none.csv"))
    with monkeypatch.context() as other:
        other.setenv("GAPFARM", str(tmp_path / "none"))
        with pytest.raises(gapfarm.GapfarmError, match="No such file"):
            gapfarm.evolve(DEMO, tmp_path / "run")
    with pytest.raises(FileNotFoundError):
        gapfarm.Run(tmp_path)
    with pytest.raises(FileNotFoundError):
        gapfarm.Model(tmp_path / "model.toml")


def test_runs_pickle_and_may_be_read_by_threads(run):
    again = pickle.loads(pickle.dumps(run))
    with concurrent.futures.ThreadPoolExecutor(4) as pool:
        tables = list(pool.map(lambda _: again.generations, range(8)))
    for table in tables:
        pd.testing.assert_frame_equal(table, run.generations)


def test_a_diagnosis_is_tables(tmp_path):
    effect = {
        "name": "motor_asymmetry", "aliases": [], "alias_reason": "", "confidence": 0.99,
        "parameters": {"ratio": {"value": 0.05, "lo": 0.04, "hi": 0.06, "unit": "-"}},
        "gap_before": 2.0, "gap_after": 0.1,
    }
    where = {"command": "forward", "component": "y", "kind": "bias", "covariate": "", "size": 0.1,
             "share": 0.5, "p": 1e-9, "text": "left"}
    data = {"version": 1, "verdict": "explained", "headline": "motor_asymmetry", "effects": [effect],
            "where": [where]}
    (tmp_path / "diagnosis.json").write_text(json.dumps(data))
    diagnosis = gapfarm.Diagnosis(tmp_path)
    assert diagnosis.verdict == "explained"
    row = diagnosis.effects.iloc[0]
    assert (row.effect, row.parameter, row.value, row.unit) == ("motor_asymmetry", "ratio", 0.05, "-")
    assert diagnosis.where.command[0] == "forward"
    data["effects"] = []
    (tmp_path / "diagnosis.json").write_text(json.dumps(data))
    assert gapfarm.Diagnosis(tmp_path).effects.empty
    with pytest.raises(FileNotFoundError, match="robot.toml"):
        gapfarm.Diagnosis(tmp_path).model


def test_the_page_of_examples_runs(run, tmp_path, monkeypatch):
    """Every block of docs/python.md, in order, in one program."""
    page = (ROOT / "docs" / "python.md").read_text()
    blocks = [b.split("```")[0] for b in page.split("```python\n")[1:]]
    assert blocks
    monkeypatch.chdir(tmp_path)
    os.symlink(ROOT / "configs", tmp_path / "configs")
    scope: dict = {}
    for block in blocks:
        exec(compile(block, "docs/python.md", "exec"), scope)


def test_a_run_of_version_0_1_is_read_as_it_is(tmp_path):
    with contextlib.closing(sqlite3.connect(tmp_path / "run.sqlite")) as db:
        db.executescript((ROOT / "tests" / "integration" / "run_of_0_1.sql").read_text())
    run = gapfarm.Run(tmp_path)
    assert list(run.generations.index) == [1, 2] and run.info["program_version"] == "0.1.0"
    assert run.genomes().shape == (4, 2) and run.incidents.empty


def test_the_notebook_runs(tmp_path, monkeypatch):
    """Every cell of docs/python.ipynb, in order, in one program."""
    cells = json.loads((ROOT / "docs" / "python.ipynb").read_text())["cells"]
    code = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    assert code and all(not cell.get("outputs") for cell in cells), "clear outputs before a commit"
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    os.symlink(ROOT / "configs", tmp_path / "configs")
    scope: dict = {}
    for number, text in enumerate(code):
        exec(compile(text, f"docs/python.ipynb, code cell {number + 1}", "exec"), scope)
    assert any("stage 1 of 6" in line for line in scope["said"]), "diagnose reports its progress"
    diagnosis = scope["diagnosis"]
    again = pickle.loads(pickle.dumps(diagnosis))
    pd.testing.assert_frame_equal(again.effects, diagnosis.effects)
    row = diagnosis.effects.iloc[0]
    assert row.lo < 0.05 < row.hi and row.unit == "-"


def test_the_objective_of_its_page_evolves(tmp_path, monkeypatch):
    """The Python program and the config of docs/objective.md, as a user would copy them."""
    page = (ROOT / "docs" / "objective.md").read_text()
    for fence, file in (("python", "train.py"), ("toml", "train.toml")):
        (tmp_path / file).write_text(page.split(f"```{fence}\n")[1].split("```")[0])
    monkeypatch.setenv("PYTHONPATH", str(ROOT / "python"))
    words = ("--generations", "8", "--workers", "2")
    run = gapfarm.evolve(tmp_path / "train.toml", tmp_path / "run", *words)
    assert run.status()["best_fitness"] < 1e-4 and run.model is not None
    assert set(run.individuals().method) <= {"sgd", "adam"}


def test_what_an_objective_cannot_answer_is_a_failed_evaluation(capsys):
    def answer(given):
        return gapfarm.objective.answer(given, {"x": 1.0}, 7)

    assert answer(lambda parameters, seed: np.float64(parameters["x"] + seed)) == {"value": 8.0, "violations": []}
    full = {"value": 2, "violations": (np.float32(0.5), -1), "notes": "as it came"}
    assert json.loads(json.dumps(answer(lambda *_: full))) == {**full, "violations": [0.5, -1]}
    assert answer(lambda *_: float("nan")) == {"outcome": "failed", "message": "its value is nan"}
    both = {"values": {"loss": np.float32(0.5), "cost": 3}}
    assert answer(lambda *_: both) == {"values": {"loss": 0.5, "cost": 3.0}, "violations": []}
    assert answer(lambda *_: {"values": {"loss": np.nan}})["message"] == "its loss is nan"
    assert answer(lambda *_: {"value": 1, "violations": [np.inf]})["message"] == "its violation is inf"
    assert answer(lambda *_: 1 / 0)["message"] == "ZeroDivisionError: division by zero"
    assert "Traceback" in capsys.readouterr().err
    assert answer(lambda *_: "rubbish")["outcome"] == "failed"
    assert "set is not JSON" in answer(lambda *_: {"value": 1, "notes": {3}})["message"]
    assert answer(lambda *_: {"values": {"a": None}}) == {"values": {"a": None}, "violations": []}


def test_an_objective_may_be_any_callable_with_numpys_bounds():
    script = (
        "import functools, numpy as np, gapfarm.objective as o\n"
        "o.serve(functools.partial(lambda data, p, seed: data + p['x'], 2),"
        " [{'key': 'x', 'lower': np.float32(-1), 'upper': np.int64(1), 'nominal': 0}])\n"
    )
    asked = '{}\n{"id": 4, "parameters": {"x": 1}, "seed": 7}\n'
    done = subprocess.run([sys.executable, "-c", script], input=asked, capture_output=True, text=True,
                          env={**os.environ, "PYTHONPATH": str(ROOT / "python")})
    declared, answered = map(json.loads, done.stdout.splitlines())
    assert declared["name"] == "objective" and declared["parameters"][0]["upper"] == 1
    assert answered == {"id": 4, "value": 3.0, "violations": []}


def test_paths_come_with_a_simulated_log(run):
    words = ("--sessions", "1", "--trials", "4", "--workers", "1")
    trials, paths = run.model.simulate_paths(*words, interval=0.1, seed=3)
    assert paths.attrs["units"] == {"t": "s", "x": "m", "y": "m", "theta": "rad"}
    assert list(paths.groupby("trial").t.min()) == [0.0] * len(trials)
    pd.testing.assert_frame_equal(trials, run.model.simulate(*words, seed=3))


def test_names_of_a_log_are_read_as_they_are(tmp_path):
    log = tmp_path / "log.csv"
    rows = "\n".join(f"{name},0,,forward,1,1,0.5,0,0,0,0.1,0,0,#2" for name in ("bot#1", "NA", "007"))
    log.write_text(f"# log: {log.name}\n#\n{','.join(gapfarm.read_trials(LOG))},note\n{rows}\n")
    trials = gapfarm.read_trials(log)
    assert list(trials.session) == ["bot#1", "NA", "007"]
    assert list(trials.note) == ["#2"] * 3
    assert trials.t.isna().all() and list(trials.x1) == [0.1] * 3


def test_windows_go_out_and_in_again(tmp_path):
    t = np.arange(5) * 0.1
    commands = pd.DataFrame({"run": "007", "t": t, "left": 0.1 + t / 3, "right": 0.2})
    poses = pd.DataFrame({"run": "007", "t": t, "x": t / 7, "y": 0.0, "theta": -t})
    gapfarm.write_windows(commands, poses, tmp_path / "monday")
    read = gapfarm.read_windows(tmp_path / "monday")
    for back, table in zip(read, (commands, poses)):
        pd.testing.assert_frame_equal(back, table, check_exact=True)
        assert back.attrs["units"]["t"] == "s"


def test_models_may_be_used_from_several_threads(run):
    model = pickle.loads(pickle.dumps(run.model))
    with concurrent.futures.ThreadPoolExecutor(3) as pool:
        tables = list(pool.map(lambda _: model.predict(LOG, workers=1), range(3)))
    for table in tables[1:]:
        pd.testing.assert_frame_equal(table, tables[0])


def public_names():
    """(name, object) of what the package shows, methods and properties of its classes with it."""
    for name in gapfarm.__all__:
        thing = getattr(gapfarm, name)
        yield name, thing
        if not inspect.isclass(thing) or issubclass(thing, Exception):
            continue
        for key, member in vars(thing).items():
            if key.startswith("_"):
                continue
            if isinstance(member, property):
                member = member.fget
            elif isinstance(member, staticmethod):
                member = member.__func__
            yield f"{name}.{key}", member


@pytest.mark.parametrize("name, thing", list(public_names()), ids=lambda x: x if isinstance(x, str) else "")
def test_every_public_name_says_what_it_is(name, thing):
    text = inspect.getdoc(thing)
    assert text, f"{name} has no docstring"
    if inspect.isclass(thing):
        return
    hints = typing.get_type_hints(thing)
    wanted = [p for p in inspect.signature(thing).parameters if p != "self"]
    assert "return" in hints and all(p in hints for p in wanted), f"{name} is not annotated"
    returned = str(hints["return"])
    if "ndarray" in returned:
        assert "shape" in text and ("float64" in text or "int64" in text), f"{name}: shape and type"
    if "DataFrame" in returned:
        assert re.search(r"\ba row an? \w+", text, re.I) or "as read_trials" in text, f"{name}: rows"
        assert re.search(r"\b(m|rad|s|nats|SI units|UTC|unit)\b", text), f"{name}: units"


USED = """
import gapfarm
run = gapfarm.Run("run")
reveal_type(run.genomes())
reveal_type(run.model.predict(run.individuals()))
run.genomes("the last one")
gapfarm.evolve("config.toml")
run.bset
"""


def test_annotations_hold_and_help_who_uses_them(tmp_path):
    package = pathlib.Path(gapfarm.__file__).parent
    assert (package / "py.typed").exists()
    api = pytest.importorskip("mypy.api")
    # pandas of Debian 12 has no annotations.
    judge = ["--strict", "--ignore-missing-imports", "--no-error-summary", f"--cache-dir={tmp_path}"]
    printed, wrong, code = api.run([*judge, str(package)])
    assert code == 0, printed + wrong
    (tmp_path / "used.py").write_text(USED)
    printed, _, _ = api.run([*judge, str(package), str(tmp_path / "used.py")])
    assert re.search(r":4: note: .*ndarray\[Any, .*float", printed), printed
    found = re.findall(r"used.py:(\d+): error: .*\[([a-z-]+)\]", printed)
    assert found == [("6", "arg-type"), ("7", "call-arg"), ("8", "attr-defined")], printed

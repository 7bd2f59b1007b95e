from pathlib import Path

import pytest

from irlpilco_ros.learning.errors import NumericalError
from irlpilco_ros.studies.job import Job
from irlpilco_ros.studies.result_store import ResultStore
from irlpilco_ros.studies.run_jobs import run_jobs
from irlpilco_ros.studies.tables import by_condition, state_of


def squared(log, number, needed=()):
    """A job that writes down that it ran."""
    with Path(log).open("a") as stream:
        stream.write(f"{number}\n")
    if number < 0:
        raise NumericalError("no root")
    return {"square": number**2 + sum(result["square"] for result in needed)}


def job(log, number, needs=(), condition="plain"):
    return Job("squares", condition, number, squared, {"log": str(log), "number": number}, needs)


def runs(log):
    return sorted(int(line) for line in log.read_text().split()) if log.exists() else []


@pytest.fixture
def log(tmp_path):
    return tmp_path / "log"


@pytest.fixture
def store(tmp_path):
    return ResultStore(tmp_path / "results")


@pytest.mark.parametrize("processes", [1, 2])
def test_what_is_on_disk_is_not_computed_again(store, log, processes):
    run_jobs([job(log, 1), job(log, 2)], store, processes)
    run_jobs([job(log, 1), job(log, 2), job(log, 3)], store, processes)
    assert runs(log) == [1, 2, 3]
    assert [store.read(job(log, n))["square"] for n in (1, 2, 3)] == [1, 4, 9]
    assert (store.folder / "squares/plain/003.json").is_file()


def test_what_a_job_needs_is_computed_first_and_once(store, log):
    base = job(log, 5, condition="base")
    run_jobs([job(log, 1, (base,)), job(log, 2, (base,))], store)
    assert runs(log) == [1, 2, 5]
    assert store.read(job(log, 2, (base,)))["square"] == 29


def test_a_result_of_other_settings_does_not_count(store, log):
    run_jobs([job(log, 1)], store)
    other = Job("squares", "plain", 1, squared, {"log": str(log), "number": 4})
    assert store.read(other) is None
    run_jobs([other], store)
    assert store.read(other)["square"] == 16
    assert store.read(job(log, 1)) is None


def test_a_failure_is_a_result_and_spoils_only_what_starts_from_it(store, log):
    bad = job(log, -1)
    jobs = [bad, job(log, 1, (bad,), "after"), job(log, 2)]
    run_jobs(jobs, store)
    run_jobs(jobs, store)
    assert runs(log) == [-1, 2]
    assert store.read(bad) == {"failed": "NumericalError: no root"}
    assert "no root" in store.read(jobs[1])["failed"]
    assert by_condition(store, jobs) == {"plain": [{"square": 4}]}
    assert "3 of 3 runs. Failed: plain, seed -1: NumericalError: no root" in state_of(store, jobs)


def test_an_error_of_the_code_is_not_a_result(store):
    broken = Job("squares", "plain", 0, squared, {"nonsense": 1})
    with pytest.raises(TypeError):
        run_jobs([broken], store)
    assert store.read(broken) is None

"""Run what is not on disk yet, several jobs at once, here or on a Dask cluster."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from contextlib import AbstractContextManager, nullcontext
from typing import Any

import joblib
from tqdm import tqdm

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.numerics.threads import one_blas_thread
from irlpilco_ros.studies.job import Job, Result
from irlpilco_ros.studies.result_store import ResultStore


def run_jobs(
    jobs: Sequence[Job], store: ResultStore, processes: int = 1, dask: str | None = None
) -> None:
    """Compute the results that the store lacks, with a progress bar; each is on disk at once.

    Args:
        jobs: What is wanted; what they need is computed first.
        store: Where results are, and go.
        processes: How many jobs run at once on this machine.
        dask: Address of a Dask scheduler whose workers do it instead; they need the package, but
            no common file system.

    Raises:
        InvalidSettingError: Dask is wanted and not installed.
    """
    needs = list({need.description: need for job in jobs for need in job.needs}.values())
    if needs:
        run_jobs(needs, store, processes, dask)
    missing = [job for job in jobs if store.read(job) is None]
    if not missing:
        return
    with _workers(dask):
        parallel = joblib.Parallel(
            n_jobs=-1 if dask else processes, return_as="generator_unordered"
        )
        tasks = (
            joblib.delayed(_compute)(number, job, [_result(need, store) for need in job.needs])
            for number, job in enumerate(missing)
        )
        title = " ".join(dict.fromkeys(job.experiment for job in missing))
        for number, result in _progress(parallel(tasks), len(missing), title):
            store.write(missing[number], result)


def _compute(number: int, job: Job, needed: Sequence[Result]) -> tuple[int, Result]:
    with one_blas_thread():
        return number, job.compute(needed)


def _result(job: Job, store: ResultStore) -> Result:
    result = store.read(job)
    assert result is not None, f"{store.path(job)} vanished"
    return result


def _progress(results: Iterable[Any], count: int, title: str) -> Iterable[Any]:
    """Show a bar in a terminal, and a line every half minute elsewhere."""
    seldom = 0.1 if sys.stderr.isatty() else 30.0
    bar: Iterable[Any] = tqdm(results, total=count, desc=title, unit="job", mininterval=seldom)
    return bar


def _workers(dask: str | None) -> AbstractContextManager[Any]:
    if dask is None:
        return nullcontext()
    try:
        from distributed import Client
    except ImportError as error:
        raise InvalidSettingError(
            "--dask needs the package distributed; install it (pip install 'irlpilco_ros[dask]')"
        ) from error
    Client(dask)  # joblib's backend takes the newest client
    backend: AbstractContextManager[Any] = joblib.parallel_config(backend="dask")
    return backend

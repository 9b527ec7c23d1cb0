# SPDX-License-Identifier: MIT
"""Cases of a study as tasks of Dask: on this machine, of a scheduler that runs, or in jobs of a cluster."""

from __future__ import annotations

import contextlib
import functools
import importlib
import os
import shutil
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from ..errors import InputError, RockddaError, how_to_install
from ..text import shown
from .case import Outcome, read_status, run_case, write_status
from .definition import Study

#: Options of dask-jobqueue that name neither files nor commands, which a study must not choose.
_OPTIONS = (
    "queue", "project", "account", "cores", "memory", "processes", "walltime", "interface", "death_timeout", "job_cpu",
    "job_mem", "job_name", "ncpus", "mem", "resource_spec", "reservation",
)  # fmt: skip

#: Seconds that a case has to write its checkpoint where its worker has died.
_PATIENCE = 60.0

#: Seconds between two checks of the jobs of the workers.
_BETWEEN = 5.0


def run_dask(study: Study, folders: list[str], where: str, workers: int | None) -> Iterator[Outcome]:
    """Run cases. A task whose worker dies is given to another one and continues from its checkpoint."""
    try:
        from distributed import Client
        from distributed import wait as wait_for
    except ImportError:
        raise RockddaError(f"Dask is not installed: {how_to_install('study')}") from None
    with contextlib.ExitStack() as stack:
        check: Callable[[], None] | None = None
        if "://" in where:
            client = stack.enter_context(Client(where))
        else:
            cluster, refused = _cluster(study, where, workers)
            stack.enter_context(cluster)
            client = stack.enter_context(Client(cluster))
            check = functools.partial(_check_jobs, cluster, refused, client)
        futures = client.map(functools.partial(run_case, patience=_PATIENCE), folders, pure=False, retries=3)
        names = {future.key: folder for future, folder in zip(futures, folders, strict=True)}
        left = set(futures)
        looked = time.monotonic()
        while left:
            finished: set[Any] = set()
            with contextlib.suppress(TimeoutError):
                finished = wait_for(left, timeout=0.5, return_when="FIRST_COMPLETED").done
            left -= finished
            for future in finished:
                yield _outcome(future, Path(names[future.key]))
            if check and left and time.monotonic() - looked > _BETWEEN:
                check()
                looked = time.monotonic()


def _outcome(future: Any, folder: Path) -> Outcome:
    """What a task has ended with; a worker that has died too often is a failure of its case."""
    if future.status == "finished":
        found: Outcome = future.result()
        return found
    status = read_status(folder)
    message = f"{type(future.exception()).__name__}: {future.exception()}"
    write_status(folder, {**status, "status": "failed", "exit_code": 1, "message": message})
    return Outcome(status["number"], status["name"], "failed", 0.0, 1, message)


def _cluster(study: Study, where: str, workers: int | None) -> tuple[Any, list[str]]:
    """A Dask cluster, on this machine or of jobs of a scheduler through dask-jobqueue; what is said of refused jobs."""
    if where == "local":
        from distributed import LocalCluster

        count = workers or max(1, (os.cpu_count() or 1) // study.threads)
        return LocalCluster(n_workers=count, threads_per_worker=1, dashboard_address=None), []
    kinds = ("SLURM", "PBS", "LSF", "SGE", "OAR", "HTCondor", "Local")
    names = {kind.lower() if kind != "Local" else "shell": f"{kind}Cluster" for kind in kinds}
    if where not in names:
        raise InputError(
            f"dask: expected an address such as tcp://host:8786, local, {', '.join(names)}; found '{where}'"
        )
    try:
        module = importlib.import_module("dask_jobqueue.local" if where == "shell" else "dask_jobqueue")
    except ImportError:
        raise RockddaError(f"dask-jobqueue is not installed: {how_to_install('cluster')}") from None
    for name in study.cluster:
        if name not in _OPTIONS:
            raise InputError(
                f"[cluster]: {shown(name)} is none of {', '.join(_OPTIONS)}; what names files or commands goes into "
                "the configuration of dask-jobqueue (~/.config/dask/jobqueue.yaml)",
                study.file,
            )
    from distributed.core import Status

    kind = getattr(module, names[where])
    refused: list[str] = []

    class Job(kind.job_cls):  # type: ignore[misc, name-defined]
        """A job whose refusal is kept: Dask would only write it to its log, and wait for the worker for ever."""

        async def start(self) -> None:
            try:
                await super().start()
            except Exception as problem:
                refused.append(str(problem).strip())
                self.status = Status.running  # as far as Dask is concerned

        async def close(self) -> None:
            await super().close()
            self.status = Status.closed  # which dask-jobqueue leaves as it is, and Dask asserts

    cluster = kind(job_cls=Job, **{"cores": 1, "processes": 1, "memory": "2GB", **study.cluster})
    cluster.scale(jobs=workers or 4)
    return cluster, refused


def _check_jobs(cluster: Any, refused: list[str], client: Any) -> None:
    """Give up where there are no workers, and none can come: the scheduler has refused the jobs, or they have ended."""
    jobs = [job for job in cluster.workers.values() if hasattr(job, "job_id")]
    if not jobs or client.scheduler_info(n_workers=-1)["workers"]:
        return
    accepted = [str(job.job_id) for job in jobs if job.job_id]
    again = "the same command continues"
    if not accepted and len(refused) >= len(jobs):
        raise RockddaError(f"the scheduler has refused the jobs of the workers; {again}:\n{refused[0]}")
    queue = shutil.which("squeue")
    if not accepted or queue is None or getattr(jobs[0], "submit_command", "") != "sbatch":
        return
    answer = subprocess.run([queue, "--noheader", "--format=%A"], capture_output=True, text=True)
    if answer.returncode or set(answer.stdout.split()) & set(accepted):
        return
    logs = ", ".join(f"slurm-{job}.out" for job in accepted)
    raise RockddaError(
        f"the jobs of the workers have ended, and cases are left (a longer walltime in [cluster]?); {again}. "
        f"What the jobs say: {logs}"
    )

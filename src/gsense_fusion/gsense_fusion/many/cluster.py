"""Sessions on a Dask cluster: the workers see the same paths as the command, and have the same gsense_fusion."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from .manifest import ManifestError
from .work import Job, Outcome, failed, work

CONNECT_S = 10.0
WORKERS_S = 60.0
"""How long the first worker may take to come."""


class ClusterError(RuntimeError):
    """The cluster was lost on the way; one line."""


def run_on_cluster(jobs: Sequence[Job], address: str) -> Iterator[Outcome]:
    """Outcomes as they come; takes back what is left when it is closed.

    Args:
        jobs: In the order in which they should begin.
        address: Of the scheduler, `tcp://HOST:8786`.

    Raises:
        ManifestError: `distributed` is not installed, or there is no scheduler or no worker there.
        ClusterError: the scheduler was lost; what was done stays.
    """
    client = _connect(address)
    try:
        from distributed import as_completed  # noqa: PLC0415 # optional

        futures = {
            client.submit(work, job, pure=False, retries=0, priority=-place): job for place, job in enumerate(jobs)
        }
        finished = as_completed(list(futures), loop=client.loop)
        for future in finished:
            yield _outcome(future, futures.pop(future))
            future.release()
    finally:
        client.close(timeout=2.0)  # lets go of its futures: the scheduler drops what nobody waits for


def _outcome(future: Any, job: Job) -> Outcome:
    try:
        if future.status in ("cancelled", "lost"):
            raise ClusterError("the scheduler was lost; start it again: the same command goes on")
        error = future.exception()
        if error is None:
            found = future.result()
            return found if isinstance(found, Outcome) else failed(job, f"a worker returned {type(found).__name__}")
    except (OSError, TimeoutError) as error:
        raise ClusterError(f"the scheduler was lost ({error}); start it again: the same command goes on") from error
    if isinstance(error, ModuleNotFoundError):
        return failed(job, f"a worker lacks {error.name}: install gsense_fusion there")
    if type(error).__name__ == "KilledWorker":  # of `distributed`, which need not be installed
        return failed(job, "the workers that had it died, by it or by one beside it; the same command tries it again")
    return failed(job, f"its worker refused it ({type(error).__name__}: {error})")


def _connect(address: str) -> Any:
    try:
        from distributed import Client  # noqa: PLC0415 # optional
    except ImportError as error:
        raise ManifestError(
            "--scheduler needs Dask's `distributed`, which is not installed: pip install distributed"
        ) from error
    try:
        client = Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise ManifestError(f"--scheduler {address}: no Dask scheduler answers there ({_line(error)})") from error
    try:
        client.wait_for_workers(1, timeout=WORKERS_S)
    except (OSError, TimeoutError) as error:
        client.close(timeout=2.0)
        raise ManifestError(
            f"--scheduler {address}: no worker came within {WORKERS_S:g} s; start some: dask worker {address}"
        ) from error
    return client


def _line(error: BaseException) -> str:
    return " ".join(str(error).split()) or type(error).__name__

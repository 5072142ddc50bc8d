"""Tasks on Dask's workers, or one after the other; their results in a folder, each whole or not there."""

from __future__ import annotations

import contextlib
import json
import os
import pathlib
import shutil
import tempfile
import time
from dataclasses import dataclass
from typing import Any, Callable, Iterator, Optional

from .tasks import CampaignError, Task, perform

# A task whose worker went away is run again on another; one that takes so many workers with it is given up.
MOST_LOST_WORKERS = 10


@dataclass(frozen=True)
class TaskFailure:
    task: Task
    why: str


def folder_of(out: pathlib.Path, task: Task) -> pathlib.Path:
    return out / "results" / task.name


def spec_text(task: Task) -> str:
    return json.dumps(task.spec, indent=1, sort_keys=True) + "\n"


def is_done(out: pathlib.Path, task: Task) -> bool:
    """Whether the folder has the result of just this task; that of another specification does not count."""
    try:
        return (folder_of(out, task) / "task.json").read_text() == spec_text(task)
    except OSError:
        return False


def store(out: pathlib.Path, task: Task, files: dict[str, bytes]) -> None:
    """All of a result at once: whoever looks finds it whole or not at all."""
    final = folder_of(out, task)
    with tempfile.TemporaryDirectory(prefix=".part-", dir=out) as scratch:
        made, old = pathlib.Path(scratch) / "made", pathlib.Path(scratch) / "old"
        made.mkdir()
        for name, content in files.items():
            (made / name).write_bytes(content)
        (made / "task.json").write_text(spec_text(task))
        if final.exists():
            final.rename(old)
        made.rename(final)


def prepare(out: pathlib.Path) -> None:
    try:
        (out / "results").mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CampaignError(f"{out}: the folder cannot be made ({error.strerror}); name another") from error
    # Of a campaign that was ended by force.
    for left in out.glob(".part-*"):
        shutil.rmtree(left, ignore_errors=True)


@contextlib.contextmanager
def local_client(workers: int) -> Iterator[Any]:
    """Dask on this machine alone, without its dashboard, a process for each worker."""
    dask, distributed = import_dask()
    settings = {"distributed.scheduler.allowed-failures": MOST_LOST_WORKERS}
    with dask.config.set(settings), tempfile.TemporaryDirectory() as scratch:
        with distributed.LocalCluster(n_workers=workers, threads_per_worker=1, processes=True, host="127.0.0.1",
                                      dashboard_address=None, local_directory=scratch, silence_logs="ERROR") as cluster:
            with distributed.Client(cluster) as client:
                yield client


@contextlib.contextmanager
def remote_client(address: str) -> Iterator[Any]:
    """A scheduler that runs already; its workers have Berth and this package installed."""
    _, distributed = import_dask()
    try:
        with distributed.Client(address, timeout=10) as client:
            yield client
    except OSError as error:
        raise CampaignError(f"--scheduler {address}: nothing answers there ({error}); start dask-scheduler") from error


def import_dask() -> tuple[Any, Any]:
    try:
        import dask
        import distributed
    except ImportError as error:
        raise CampaignError("Dask is not installed; pip install 'berth[campaign]', or use --workers 0") from error
    return dask, distributed


def one_by_one(tasks: list[Task], berth: str) -> Iterator[tuple[Task, Any]]:
    for task in tasks:
        try:
            yield task, perform(task, berth)
        except Exception as error:  # whatever it is, as a worker's
            yield task, TaskFailure(task, str(error))


def on_workers(tasks: list[Task], berth: str, client: Any) -> Iterator[tuple[Task, Any]]:
    _, distributed = import_dask()
    # Keys are Dask's own: results are known by the folder, not by what a scheduler still remembers.
    futures = {client.submit(perform, task, berth, pure=False): task for task in tasks}
    for future in distributed.as_completed(list(futures)):
        task = futures.pop(future)
        error = future.exception()
        yield task, TaskFailure(task, f"{error}") if error is not None else future.result()
        future.release()


class Progress:
    """How far it is and how long it will take: in place on a terminal, else a line now and then."""

    def __init__(self, total: int, done: int, write: Callable[[str], None], is_terminal: bool) -> None:
        self.total, self.done, self.before = total, done, done
        self.write, self.is_terminal = write, is_terminal
        self.began = time.monotonic()
        self.told = float("-inf")

    def step(self) -> None:
        self.done += 1
        now = time.monotonic()
        every = 0.2 if self.is_terminal else 5.0
        if self.done < self.total and now - self.told < every:
            return
        self.told = now
        left = (now - self.began) / (self.done - self.before) * (self.total - self.done)
        end = "\n" if not self.is_terminal or self.done == self.total else ""
        start = "\r\x1b[2K" if self.is_terminal else ""
        self.write(f"{start}{self.done} of {self.total} tasks ({100 * self.done // self.total} %), {left:.0f} s left{end}")


def run_tasks(tasks: list[Task], out: str | os.PathLike[str], berth: str = "berth", client: Optional[Any] = None,
              write: Callable[[str], None] = lambda _: None, is_terminal: bool = False) -> list[TaskFailure]:
    """Runs what the folder has no result of yet, and stores each result as it comes.

    client: Dask's; without one, the tasks are run here, one after the other. Returns those that failed, in the tasks'
    order; the same call tries them again. What comes out is the same whatever the client, the order or the losses.
    """
    out = pathlib.Path(out)
    prepare(out)
    pending = [task for task in tasks if not is_done(out, task)]
    if len(pending) < len(tasks):
        write(f"{len(tasks) - len(pending)} of {len(tasks)} tasks are there already\n")
    progress = Progress(len(tasks), len(tasks) - len(pending), write, is_terminal)
    failures = {}
    results = one_by_one(pending, berth) if client is None else on_workers(pending, berth, client)
    for task, result in results:
        if isinstance(result, TaskFailure):
            failures[task.name] = result
        else:
            store(out, task, result)
        progress.step()
    return [failures[task.name] for task in tasks if task.name in failures]

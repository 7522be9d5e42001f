"""Where runs are done: in processes of this machine (joblib), or on a Ray cluster. Same worker."""

import logging
import os
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from joblib import Parallel, delayed

from hil.bench.campaign.plan import RunSpec
from hil.bench.campaign.row import Row
from hil.errors import InputError

Work = Callable[[RunSpec], Row]
Backend = Callable[[Work, Sequence[RunSpec], int], Iterator[Row]]

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")  # one run, one core
HERE = "127.0.0.1"


def local(work: Work, specs: Sequence[RunSpec], jobs: int) -> Iterator[Row]:
    """In `jobs` processes, or in this one when it is one; rows as they finish."""
    for name in THREADS:
        os.environ.setdefault(name, "1")  # those that are started inherit it
    parallel = Parallel(
        n_jobs=jobs, return_as="generator_unordered", batch_size=1, pre_dispatch="2*n_jobs"
    )
    yield from parallel(delayed(work)(spec) for spec in specs)


def ray(work: Work, specs: Sequence[RunSpec], jobs: int) -> Iterator[Row]:
    """On the cluster that RAY_ADDRESS names, else one that is started here, on 127.0.0.1.

    At most `jobs` runs at a time. Raises InputError when Ray is not installed.
    """
    for name in THREADS:
        os.environ.setdefault(name, "1")  # a cluster that is started here inherits it
    cluster = _ray()
    quiet = {"log_to_driver": False, "logging_level": logging.ERROR}
    if os.environ.get("RAY_ADDRESS"):
        cluster.init(**quiet)
    else:
        cluster.init(num_cpus=jobs, include_dashboard=False, _node_ip_address=HERE, **quiet)
    try:
        task = cluster.remote(work)
        waiting, running = list(reversed(specs)), list[Any]()
        while waiting or running:
            while waiting and len(running) < jobs:
                running.append(task.remote(waiting.pop()))
            done, running = cluster.wait(running, num_returns=1)
            yield from cluster.get(done)
    finally:
        cluster.shutdown()


BACKENDS: dict[str, Backend] = {"local": local, "ray": ray}


def _ray() -> Any:
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
    try:
        import ray as installed
    except ImportError:
        raise InputError(
            "--backend ray: Ray is not installed; pip install 'hil-fleet[ray]'"
        ) from None
    return installed

"""Jobs on other computers: workers of Dask's scheduler, and those that Slurm starts."""

from daq.plugins import Executor, Plugin

_ADDRESS, _WORKERS = "extras.lab.cluster.address:", "extras.lab.cluster.dask:dask_workers"

PLUGIN = Plugin(
    executors=(
        Executor(
            "dask",
            "dask://host:8786",
            f"{_ADDRESS}dask",
            _WORKERS,
            ("cluster", "distributed"),
            {"workers": (r"\d+", "20")},
        ),
        Executor("dask+tls", "dask+tls://host:8786", f"{_ADDRESS}dask_by_tls", _WORKERS, ("cluster", "distributed")),
        Executor(
            "slurm",
            "slurm://partition?workers=20",
            f"{_ADDRESS}slurm",
            "extras.lab.cluster.slurm:slurm_workers",
            ("cluster", "dask_jobqueue"),
            {
                "workers": (r"\d+", "20"),
                "memory": (r"\d+(\.\d+)?[KMGT]i?B", "4GB"),
                "walltime": (r"(\d+-)?\d{1,2}:\d{2}(:\d{2})?", "02:00:00"),
                "account": (r"[\w.-]+", "robotics"),
                "interface": (r"[\w.-]+", "ib0"),
            },
        ),
    )
)

"""Results of jobs as files: EXPERIMENT/CONDITION/SEED.json, each whole or not there."""

from __future__ import annotations

import json
from pathlib import Path

from irlpilco_ros.experience.durable import write_atomically
from irlpilco_ros.studies.job import Job, Result


class ResultStore:
    """The folder of a study. What is in it is not computed again."""

    def __init__(self, folder: Path) -> None:
        """Take a folder, which need not exist yet."""
        self.folder = folder

    def path(self, job: Job) -> Path:
        """Return where a job's result belongs."""
        return self.folder / job.experiment / job.condition / f"{job.seed:03d}.json"

    def read(self, job: Job) -> Result | None:
        """Return a job's result; None if there is none, or one of other settings."""
        try:
            document = json.loads(self.path(job).read_text(encoding="utf-8"))
        except FileNotFoundError:
            return None
        if document["description"] != job.description:
            return None
        result: Result = document["result"]
        return result

    def write(self, job: Job, result: Result) -> None:
        """Put a job's result on disk."""
        path = self.path(job)
        path.parent.mkdir(parents=True, exist_ok=True)
        document = {"description": job.description, "result": result}
        write_atomically(path, json.dumps(document).encode())

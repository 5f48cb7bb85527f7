"""Submits a job script of HyperQueue to a server and two workers in this process: submit_hyperqueue.py SCRIPT FOLDER

The package has no `hq submit`, so its directives are read here; tasks are numbered from 0 in this interface, in scripts as they ask for.
"""

import sys
from pathlib import Path

from hyperqueue import Job, LocalCluster
from hyperqueue.cluster import WorkerConfig
from hyperqueue.ffi.protocol import ResourceRequest

script, folder = Path(sys.argv[1]), Path(sys.argv[2])
directives = dict(line.split()[1:] for line in script.read_text().splitlines() if line.startswith("#HQ "))
first, last = map(int, directives["--array"].split("-"))
job = Job(folder, name=directives["--name"])
for task in range(first, last + 1):
    command = ["env", f"HQ_TASK_ID={task}", "bash", str(script)]
    job.program(command, resources=ResourceRequest(cpus=int(directives["--cpus"])))
with LocalCluster(str(folder)) as cluster:
    for _ in range(2):
        cluster.start_worker(WorkerConfig(cores=1))
    client = cluster.client()
    # raises if a task fails
    client.wait_for_jobs([client.submit(job)])
print(f"{last - first + 1} tasks done by 2 workers")

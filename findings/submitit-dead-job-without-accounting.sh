#!/usr/bin/env bash
# submitit never notices a dead job on a Slurm without accounting, which is Slurm's default.
#
# What one would guess: `job.done()` turns true, or `job.result()` raises, some time after a Slurm job was killed.
# What happens: submitit asks only `sacct`. Without accounting it answers nothing, the state stays UNKNOWN, which counts
# as not done, and `job.result()` waits for ever, while `squeue --states=all` says FAILED at once. Every question to
# sacct prints 'Slurm accounting storage is disabled' on the terminal.
# Versions: submitit 1.5.4, Slurm 22.05.8 (Debian 12), November 2026.
# Needs a Slurm of one node on the loopback interface (Debian: apt-get install slurm-wlm munge; run as root).
set -euo pipefail
command -v slurmctld slurmd munged >/dev/null || { echo "no Slurm here: apt-get install slurm-wlm munge"; exit 2; }
folder=$(mktemp -d)
started=()
trap 'for pid in "${started[@]}"; do kill "$pid" 2>/dev/null || true; done; wait; rm -rf "$folder"' EXIT
cd "$folder"
mkdir state spool
(umask 077 && head -c 64 /dev/urandom >munge.key)
munged --foreground --force --key-file="$folder/munge.key" --socket="$folder/munge.socket" --pid-file="$folder/munge.pid" \
    --log-file="$folder/munge.log" --seed-file="$folder/munge.seed" >/dev/null 2>&1 &
started+=($!)
host=$(hostname -s)
cat >slurm.conf <<CONF
ClusterName=loopback
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=26817
SlurmdPort=26818
AuthType=auth/munge
AuthInfo=socket=$folder/munge.socket
SlurmUser=root
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
ReturnToService=2
NodeName=node1 NodeHostname=$host NodeAddr=127.0.0.1 CPUs=1 State=UNKNOWN
PartitionName=all Nodes=node1 Default=YES MaxTime=INFINITE State=UP
CONF
export SLURM_CONF=$folder/slurm.conf
sleep 1
slurmctld -D -f slurm.conf >slurmctld.log 2>&1 &
started+=($!)
slurmd -D -f slurm.conf -N node1 >slurmd.log 2>&1 &
started+=($!)
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check submitit==1.5.4
sinfo --version
venv/bin/python - <<'PYTHON'
import os
import signal
import subprocess
import sys
import time

import submitit

executor = submitit.AutoExecutor("jobs", cluster="slurm")
executor.update_parameters(timeout_min=5)
job = executor.submit(lambda: os.kill(os.getpid(), signal.SIGKILL))
command = ["squeue", "--noheader", "--states=all", f"--jobs={job.job_id}", "--format=%T"]
deadline = time.monotonic() + 60.0
while (queue := subprocess.check_output(command, text=True).strip()) not in ("FAILED", "COMPLETED"):
    if time.monotonic() > deadline:
        raise SystemExit(f"the job does not run: {queue}")
    time.sleep(1.0)
time.sleep(30.0)
done, state = job.done(force_check=True), job.state
print(f"submitit {submitit.__version__}: half a minute after squeue said {queue}")
print(f"expected done() to be True and a state of FAILED; got {done} and {state}")
sys.exit((queue, done, state) != ("FAILED", False, "UNKNOWN"))
PYTHON

"""Read the kernel's table of processes, with which tests check that no process is left."""

from pathlib import Path

THERE = Path("/proc/self/stat").exists()


def processes_below(parent):
    """Return the ids of all descendants of a process."""
    children = {}
    for entry in Path("/proc").glob("[0-9]*/stat"):
        try:
            pid, rest = entry.read_text().split(" ", 1)
        except OSError:
            continue
        children.setdefault(int(rest.rpartition(")")[2].split()[1]), []).append(int(pid))
    found, waiting = [], [parent]
    while waiting:
        below = children.get(waiting.pop(), [])
        found += below
        waiting += below
    return found


def workers_below(parent):
    """Return the ids of descendants of a process that are workers of the package."""
    return [pid for pid in processes_below(parent) if "walkerlab.pipeline.run.workers" in command_of(pid)]


def command_of(pid):
    """Return the command that started a process, or an empty string if it has ended."""
    try:
        return Path(f"/proc/{pid}/cmdline").read_text()
    except OSError:
        return ""


def is_alive(pid):
    """Whether a process still runs. A killed process runs until all its threads have ended. It may then still have to
    be waited for.
    """
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return False
    state, threads = fields[0], int(fields[17])
    return state != "Z" or threads > 1

"""`walkerlab rerun`: recompute a stored result from its own config."""

import tempfile
from pathlib import Path

from walkerlab.config.files import ConfigFile
from walkerlab.config.loader import load
from walkerlab.errors import ConfigError, StaleError
from walkerlab.pipeline.run.runner import execute
from walkerlab.pipeline.store.artifact import Damaged, read
from walkerlab.pipeline.store.runfolder import RunFolder
from walkerlab.views.cli.failures import print_result
from walkerlab.views.cli.request import Request

DIGEST_CHARACTERS = 12


def rerun_artifact(path: Path, request: Request) -> None:
    """Recompute an artifact in an empty folder.

    Raises ConfigError if missing, StaleError if damaged or not reproduced.
    """
    try:
        stored = read(path)
    except (FileNotFoundError, NotADirectoryError):
        raise ConfigError(f"there is no artifact {path}.", "`walkerlab status` lists a run's artifacts.") from None
    except Damaged as error:
        advice = f"`walkerlab {path.stem} -c {RunFolder.open_folder(path.parent).quoted_path}` recomputes it."
        raise StaleError(f"{path} is damaged: {error}.", advice) from None
    stage = stored.identity.stage
    name = path.resolve().parent.name
    config = load(ConfigFile(Path(name), str(path), stored.provenance.config)).config
    with tempfile.TemporaryDirectory(prefix="walkerlab-rerun-") as scratch:
        report = execute(config, stage, RunFolder(Path(scratch), name), reporter=request.console, graph=request.graph)
        again = None if report.artifact is None else read(report.artifact)
    before, after = stored.digest(), None if again is None else again.digest()
    same_code = again is not None and again.identity.key == stored.identity.key
    value = {
        "stage": stage,
        "artifact": str(path),
        "same": before == after,
        "digest": before,
        "digest_again": after,
        "same_code": same_code,
    }
    if before == after:
        print_result(request, value, [f"{path} is reproduced bit for bit: content {before[:DIGEST_CHARACTERS]}."])
        return
    why = "the code is the same" if same_code else "the code has changed since"
    another = StaleError(
        f"{path} is not reproduced: its content digest was {before[:DIGEST_CHARACTERS]} "
        f"and is now {(after or 'missing')[:DIGEST_CHARACTERS]}; {why}.",
        "Results agree bit for bit only on the same platform with the same versions; `walkerlab show` lists both.",
    )
    print_result(request, value, [], another)

"""Check that results are the same to the last bit in any process and in any number of processes."""

from walkerlab.pipeline.store import artifact

CONFIG = """
extends: paper
name: same
strides: 1
tune: {cells: 3, rigid_limit: false}
"""


def test_results_and_drawings_do_not_depend_on_the_number_of_jobs(walker):
    (walker.folder / "same.yaml").write_text(CONFIG)
    for jobs in ("1", "2"):
        for stage in ("tune", "plot"):
            done = walker(stage, "--jobs", jobs, "-c", "same.yaml", "--runs", jobs, "--quiet")
            assert done.returncode == 0, done.stderr
    one, two = (walker.folder / jobs / "same" for jobs in ("1", "2"))
    names = {path.name for path in one.glob("*.h5")}
    assert names == {f"{stage}.h5" for stage in ("fixedpoint", "simulate", "contact-sim", "tune", "compare", "plot")}
    for name in names:
        assert artifact.read(one / name).digest() == artifact.read(two / name).digest(), name
    figures = sorted((one / "figures").iterdir())
    assert len(figures) > 10
    assert [path.name for path in figures if path.read_bytes() != (two / "figures" / path.name).read_bytes()] == []

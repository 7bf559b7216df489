"""The stage: from results and drawn files to one file and its index."""

import hashlib

import pytest
from html_page import Page
from synthetic_results import EVERYTHING, config, stored

from walkerlab.config.canonical import only
from walkerlab.config.schema import Config
from walkerlab.errors import StorageError
from walkerlab.report.images import fitting
from walkerlab.stages import report
from walkerlab.stages.graph import PIPELINE
from walkerlab.stages.plan import LeftOut
from walkerlab.stages.progress import Silent
from walkerlab.store.index import broken_file, indexed_files

SVG = b'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 518.4 396"><script>alert(1)</script></svg>'
READS = PIPELINE["report"].reads


def plot(folder, svg=SVG, **changed):
    (folder / "figures").mkdir(exist_ok=True)
    (folder / "figures/figure-07.svg").write_bytes(svg)
    (folder / "figures/figure-07.png").write_bytes(b"\x89PNG")
    figure = {"number": 7, "title": "Legs", "caption": "Both.", "svg": "figures/figure-07.svg"}
    return stored("plot", {}, {"figures": [figure | {"png": "figures/figure-07.png"} | changed]})


def run(folder, *sets, inputs=None, left_out=()):
    made = {name: make() for name, make in EVERYTHING.items()} if inputs is None else inputs
    return report.run(only(config(*sets), READS), made, Silent(), folder, left_out)


def test_the_page_is_written_and_indexed(tmp_path):
    content = run(tmp_path)
    assert content.summary["html"] == "report.html"
    written = (tmp_path / "report.html").read_bytes()
    assert indexed_files(content) == {"report.html": hashlib.sha256(written).hexdigest()}
    assert broken_file(tmp_path, content) is None
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]


def test_the_summary_lists_figures_and_tables_as_they_stand_on_the_page(tmp_path):
    inputs = {name: make() for name, make in EVERYTHING.items()} | {"plot": plot(tmp_path)}
    content = run(tmp_path, inputs=inputs)
    page = Page((tmp_path / "report.html").read_text())
    assert content.summary["tables"] == page.said("caption")
    assert content.summary["figures"] == ["Figure 7. Legs."]
    assert "Figure 7. Legs." in page.said("b")


def test_drawn_figures_are_embedded_whole_and_their_scripts_cannot_run(tmp_path):
    run(tmp_path, inputs={"plot": plot(tmp_path)})
    html = (tmp_path / "report.html").read_text()
    (image,) = Page(html).all("img")
    assert image["src"].startswith("data:image/svg+xml;base64,")
    assert (image["width"], image["height"]) == ("518", "396")
    assert "alert(1)" not in html


def test_the_same_results_give_the_same_file(tmp_path):
    inputs = {name: make() for name, make in EVERYTHING.items()} | {"plot": plot(tmp_path)}
    first = (run(tmp_path, inputs=inputs).digest(), (tmp_path / "report.html").read_bytes())
    assert (run(tmp_path, inputs=inputs).digest(), (tmp_path / "report.html").read_bytes()) == first


def test_the_page_shows_the_whole_config_so_the_stage_reads_all_of_it():
    assert set(only_top(READS)) == set(Config.model_fields)


def only_top(reads):
    names = {"slope": "slope_rad", "gravity": "gravity_m_s2"}
    return [names.get(name, name) for name in reads]


def test_a_slope_without_a_gait_has_a_page_that_says_so_first(tmp_path):
    why = "no gait at a slope of 0.2 rad"
    left_out = [
        LeftOut("fixedpoint", why),
        *(LeftOut(name, f"it needs fixedpoint: {why}") for name in ("simulate", "compare")),
    ]
    content = run(tmp_path, "slope_rad=0.2", inputs={}, left_out=left_out)
    said = Page((tmp_path / "report.html").read_text()).said("p")
    assert next(text for text in said if "fixedpoint" in text).startswith(f"fixedpoint has no answer: {why}")
    assert content.summary["figures"] == []


def test_stages_that_need_contact_do_not_fail_without_it(tmp_path):
    left_out = [
        LeftOut("contact-sim", "the config has no contact block"),
        LeftOut("compare", "the config has no contact block"),
    ]
    run(tmp_path, "contact=null", inputs={"simulate": EVERYTHING["simulate"]()}, left_out=left_out)
    assert "has no answer" not in (tmp_path / "report.html").read_text()


def test_a_page_that_cannot_be_stored_is_told_and_leaves_the_old_one(tmp_path):
    (tmp_path / "report.html").mkdir()
    with pytest.raises(StorageError):
        run(tmp_path)


def test_drawings_too_large_together_are_embedded_as_pixels_largest_first(tmp_path):
    drawings = []
    for name, size in (("a", 100), ("b", 900), ("c", 300)):
        svg, png = tmp_path / f"{name}.svg", tmp_path / f"{name}.png"
        svg.write_bytes(b"x" * size)
        png.write_bytes(b"x" * 50)
        drawings.append((svg, png))
    assert [path.name for path in fitting(drawings, most=10_000)] == ["a.svg", "b.svg", "c.svg"]
    assert [path.name for path in fitting(drawings, most=500)] == ["a.svg", "b.png", "c.svg"]
    assert [path.name for path in fitting(drawings, most=200)] == ["a.svg", "b.png", "c.png"]

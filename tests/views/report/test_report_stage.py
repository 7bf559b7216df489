"""Tests of the stage `report`, which makes one page and an index from results and figures."""

import hashlib

import pytest
from html_page import Page
from synthetic_results import EVERYTHING, config, stored

from walkerlab.config.schema import Config
from walkerlab.errors import StorageError
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.progress import Silent
from walkerlab.pipeline.store.artifact import broken_file, indexed_files
from walkerlab.scene.omissions import STILL_COMPUTED, STOPPED, LeftOut
from walkerlab.views.report import stage as report
from walkerlab.views.report.page import choose_images
from walkerlab.views.report.stage import write_pages

SVG = b"""<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 518.4 396" onload="alert(1)"><script>alert(1)</script>
<foreignObject/><path d="M0 0L518 396" onclick="alert(1)" style="fill: url(https://elsewhere.example/x)"/>
<image href="https://elsewhere.example/y"/></svg>"""


def plot(folder, svg=SVG, **changed):
    (folder / "figures").mkdir(exist_ok=True)
    (folder / "figures/figure-07.svg").write_bytes(svg)
    (folder / "figures/figure-07.png").write_bytes(b"\x89PNG")
    figure = {"number": 7, "title": "Legs", "caption": "Both.", "svg": "figures/figure-07.svg"}
    return stored("plot", {}, {"figures": [figure | {"png": "figures/figure-07.png"} | changed]})


def run(folder, *sets, inputs=None, left_out=()):
    made = {name: make() for name, make in EVERYTHING.items()} if inputs is None else inputs
    return report.run(config(*sets), made, Silent(), folder, left_out)


def test_page_is_written_and_indexed(tmp_path):
    content = run(tmp_path)
    assert content.summary["html"] == "report.html"
    pages = sorted(tmp_path.iterdir())
    assert [path.name for path in pages] == ["report-paper.html", "report.html"] == sorted(content.summary["pages"])
    assert indexed_files(content) == {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in pages}
    assert broken_file(tmp_path, content) is None


def test_summary_lists_figures_and_tables_in_page_order(tmp_path):
    inputs = {name: make() for name, make in EVERYTHING.items()} | {"plot": plot(tmp_path)}
    content = run(tmp_path, inputs=inputs)
    pages = [Page((tmp_path / file).read_text()) for file in content.summary["pages"]]
    assert content.summary["tables"] == [caption for page in pages for caption in page.said("caption")]
    assert content.summary["figures"] == ["Figure 7. Legs."]
    assert "Figure 7. Legs." in pages[0].said("b")


def test_embedded_figures_contain_no_scripts_or_links(tmp_path):
    run(tmp_path, inputs={"plot": plot(tmp_path)})
    html = (tmp_path / "report.html").read_text()
    (drawn,) = [attrs for attrs in Page(html).all("svg") if attrs.get("viewbox") == "0 0 518.4 396"]
    assert drawn["aria-label"].startswith("Legs.")
    assert "M0 0L518 396" in html
    for part in ("alert", "onload", "foreignObject", "elsewhere.example"):
        assert part not in html


def test_report_uses_figure_numbers_of_the_paper_only_for_the_scene_of_the_paper(tmp_path):
    departs = stored("compare", {}, {**EVERYTHING["compare"]().summary, "departures": ["slope_rad 0.05"]})
    inputs = {"compare": EVERYTHING["compare"](), "plot": plot(tmp_path)}
    assert run(tmp_path, inputs=inputs).summary["figures"] == ["Figure 7. Legs."]
    assert run(tmp_path, inputs=inputs | {"compare": departs}).summary["figures"] == ["Legs."]


def test_report_of_another_scene_only_links_the_paper(tmp_path):
    departs = stored("compare", {}, {**EVERYTHING["compare"]().summary, "departures": ["slope_rad 0.05"]})
    inputs = {"fixedpoint": EVERYTHING["fixedpoint"](), "compare": departs, "plot": plot(tmp_path)}
    run(tmp_path, "source=null", inputs=inputs)
    page = Page((tmp_path / "report.html").read_text())
    words = " ".join(
        text for tag in page.words if tag not in ("style", "script", "code", "a") for text in page.said(tag)
    )
    assert "the paper" not in words.replace("config paper", "").lower()
    assert {"href": "report-paper.html"} in page.all("a")


def test_page_lists_what_is_still_being_computed(tmp_path):
    left_out = [LeftOut("compare", STILL_COMPUTED), LeftOut("accuracy", STILL_COMPUTED)]
    left_out.append(LeftOut("tune", "the config has no contact block"))
    write_pages(config(), {"simulate": EVERYTHING["simulate"]()}, tmp_path, left_out)
    page = Page((tmp_path / "report.html").read_text())
    assert any("Not computed yet when this page was written: compare, accuracy." in text for text in page.said("p"))
    assert sum("Not computed yet: " in text for text in page.said("p")) == 2
    assert STILL_COMPUTED not in page.text
    assert [attrs for attrs in page.all("figure") if "data-player" in attrs]


def test_early_drawing_says_what_it_waits_for(tmp_path):
    run(tmp_path, inputs={"simulate": EVERYTHING["simulate"]()}, left_out=[LeftOut("compare", STILL_COMPUTED)])
    assert "when this page was written: compare." in Page((tmp_path / "report.html").read_text()).text


def test_early_page_stays_correct_if_its_command_is_interrupted(tmp_path):
    folder = tmp_path / "stopped"
    folder.mkdir()
    run(folder, inputs={"simulate": EVERYTHING["simulate"]()}, left_out=[LeftOut("plot", STILL_COMPUTED)])
    html = (folder / "report.html").read_text()
    assert "till being computed" not in html
    assert "If nothing runs any more, <code>walkerlab report -c stopped</code> computes the rest" in html
    assert "<code>walkerlab status -c stopped</code> shows what runs" in html


def test_page_says_that_its_command_was_interrupted(tmp_path):
    folder = tmp_path / "stopped"
    folder.mkdir()
    run(folder, inputs={"simulate": EVERYTHING["simulate"]()}, left_out=[LeftOut("plot", STOPPED)])
    html = (folder / "report.html").read_text()
    said = "The command was stopped before it had computed: plot. <code>walkerlab report -c stopped</code>"
    assert f"{said} computes the rest." in html
    assert "Not computed yet when" not in html


def test_outdated_extra_page_is_removed(tmp_path):
    run(tmp_path)
    assert (tmp_path / "report-paper.html").exists()
    run(tmp_path, inputs={"simulate": EVERYTHING["simulate"]()})
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]


@pytest.mark.parametrize(
    ("sets", "said"),
    [
        ((), "A Modeling Framework for Rigid Legs Passive Dynamic Biped Walkers in MSC ADAMS"),
        (
            ("source={title: Wheels, authors: T. McGeer, published: 'IJRR, 1990', url: 'https://a.example/b'}",),
            "Wheels",
        ),
    ],
)
def test_page_names_and_links_the_reproduced_study(tmp_path, sets, said):
    run(tmp_path, *sets)
    page = Page((tmp_path / "report.html").read_text())
    assert said in page.text
    if sets:
        assert "T. McGeer," in page.text
        assert {"href": "https://a.example/b", "rel": "noreferrer"} in page.all("a")


def test_equal_results_give_equal_files(tmp_path):
    inputs = {name: make() for name, make in EVERYTHING.items()} | {"plot": plot(tmp_path)}
    first = (run(tmp_path, inputs=inputs).digest(), (tmp_path / "report.html").read_bytes())
    assert (run(tmp_path, inputs=inputs).digest(), (tmp_path / "report.html").read_bytes()) == first


def test_report_stage_reads_the_whole_config():
    assert set(PIPELINE["report"].reads(Config())) == set(Config.model_fields)


def test_page_of_a_slope_without_a_gait_says_so_first(tmp_path):
    why = "no gait at a slope of 0.2 rad"
    left_out = [
        LeftOut("fixedpoint", why),
        *(LeftOut(name, f"it needs fixedpoint: {why}") for name in ("simulate", "compare")),
    ]
    content = run(tmp_path, "slope_rad=0.2", inputs={}, left_out=left_out)
    said = Page((tmp_path / "report.html").read_text()).said("p")
    assert next(text for text in said if "fixedpoint" in text).startswith(f"fixedpoint could not be computed: {why}")
    assert content.summary["figures"] == []


def test_drawing_stages_do_not_fail_without_contact(tmp_path):
    left_out = [
        LeftOut("contact-sim", "the config has no contact block"),
        LeftOut("compare", "the config has no contact block"),
    ]
    run(tmp_path, "contact=null", inputs={"simulate": EVERYTHING["simulate"]()}, left_out=left_out)
    assert "could not be computed" not in (tmp_path / "report.html").read_text()


def test_page_that_cannot_be_stored_leaves_the_old_one(tmp_path):
    (tmp_path / "report.html").mkdir()
    with pytest.raises(StorageError):
        run(tmp_path)


def test_largest_drawings_become_pixel_images_if_the_page_is_too_large(tmp_path):
    drawings = []
    for name, size in (("a", 100), ("b", 900), ("c", 300)):
        svg, png = tmp_path / f"{name}.svg", tmp_path / f"{name}.png"
        svg.write_bytes(b"x" * size)
        png.write_bytes(b"x" * 50)
        drawings.append((svg, png))
    assert [path.name for path in choose_images(drawings, most=10_000)] == ["a.svg", "b.svg", "c.svg"]
    assert [path.name for path in choose_images(drawings, most=500)] == ["a.svg", "b.png", "c.svg"]
    assert [path.name for path in choose_images(drawings, most=200)] == ["a.svg", "b.png", "c.png"]

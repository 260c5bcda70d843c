"""The page about materials: its tables by hand, and the page of the docs against its tables."""

from fixtures.markdown import collapse_spaces

from dav_gswt.study import csv_tables
from dav_gswt.study.markdown import render_template
from dav_gswt.study.materials.page import describe_materials

NAMES = ("materials", "lattice", "transitions", "verdicts")
KEPT = "docs/research/data"
ROWS = {
    "materials": "scene,iou_sand,iou_meadow,iou_boulders,iou_path,mean_iou,objects,found,wrong,precision,recall,f1\n"
    "dune,0.8366,0.9,1,0,0.68404,6,5,2,0.714,0.83,0.769\n",
    "lattice": "scene,of,materials,objects,brightness,landmarks,busyness,mean_tile,next\n"
    "dune,all,2,8,-0.036,-0.0004,0.367,10.05,0.1\ndune,material1,1,0,0,0,0,0,0\n",
    "transitions": "scene,terrain,photographed,difference,low,high,terrain_crops,photographed_crops,inside\n"
    "dune,0.277,0.252,0.025,-0.01,0.039,80,62,-0.0424\nsand,,,,,,0,0,\n",
    "verdicts": 'scene,of,share,objects,grade,reason\ndune,all,0.954,11,good,"1 material, 5% is shown nowhere"\n',
}


def test_tables_have_the_numbers_of_their_files(tmp_path):
    for name, text in ROWS.items():
        (tmp_path / name).write_text(text)
    made = {name: collapse_spaces(text) for name, text in describe_materials({n: tmp_path / n for n in NAMES}).items()}
    assert "| dune | .84 | .90 | 1.00 | .00 | .684 | 6 | 5 | 2 | .71 | .83 | .77 |" in made["materials"]
    assert "| dune | 2 | 8 | -.036 | -.000 | .367 | 10.050 | .100 |" in made["lattice"]
    assert "| dune, material1 alone | 1 | 0 | .000 |" in made["lattice"]
    assert "| dune | .277 | .252 | .025 | (-.010, .039) | -.042 | 80, 62 |" in made["transitions"]
    assert "| sand | no border | no border | no border | | | 0, 0 |" in made["transitions"]
    assert "| dune | all | .95 | 11 | good: 1 material, 5% is shown nowhere |" in made["verdicts"]


def test_the_page_of_the_docs_is_that_of_its_tables(root):
    tables = describe_materials({name: root / KEPT / f"{name}.csv" for name in NAMES})
    page = render_template(root / "workflow/report/materials_page.md", tables)
    assert (root / "docs/research/results/materials.md").read_text(encoding="utf-8") == page
    assert len(csv_tables.read_table(root / KEPT / "verdicts.csv")) > 10

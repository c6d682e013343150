"""Compares verdicts in the formats of other programs with summary.json.

    24-verdicts.py SUMMARY.json JUNIT.xml VERDICTS.md FOLDER

FOLDER has needs.json; a document that imports it is built there.
"""

import json
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

from junitparser import JUnitXml
from markdown_it import MarkdownIt

summary_file, junit_file, markdown_file, folder = sys.argv[1:]
summary = json.loads(Path(summary_file).read_text())
wanted = {entry["id"]: entry for entry in summary["requirements"]}

suite = next(iter(JUnitXml.fromfile(junit_file)))
assert suite.name == summary["scenario"], suite.name
end, *cases = list(suite)
assert end.name == "end of the run", end.name
assert [case.name for case in cases] == list(wanted), cases
# The reader leaves properties of test cases out.
properties_of = {
    case.get("name"): {each.get("name"): each.get("value") for each in case.iterfind("properties/property")}
    for case in ElementTree.parse(junit_file).iter("testcase")
}
for case in cases:
    entry = wanted[case.name]
    assert case.is_passed == entry["met"], case.name
    properties = properties_of[case.name]
    assert properties["text"] == entry["text"], properties
    if entry["margin"] is None:
        assert "margin" not in properties, properties
    else:
        assert float(properties["margin"]) == entry["margin"], properties
all_good = end.is_passed and all(case.is_passed for case in cases)
assert all_good == summary["passed"], "passed"
assert suite.tests == len(wanted) + 1 and suite.failures == sum(not case.is_passed for case in [end, *cases])


class Rows(HTMLParser):
    """Cells of a table by row, as text."""

    def __init__(self, text):
        super().__init__()
        self.rows = []
        self.cell = None
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        if tag == "tr":
            self.rows.append([])
        elif tag in ("td", "th"):
            self.rows[-1].append("")
            self.cell = True

    def handle_endtag(self, tag):
        if tag in ("td", "th"):
            self.cell = None

    def handle_data(self, data):
        if self.cell:
            self.rows[-1][-1] += data


_, *rows = Rows(MarkdownIt("commonmark").enable("table").render(Path(markdown_file).read_text())).rows
assert len(rows) == len(wanted), rows
for (name, verdict, _, _), entry in zip(rows, wanted.values()):
    assert name == f"{entry['id']}: {entry['text']}", name
    assert verdict == ("met" if entry["met"] else "missed"), verdict

folder = Path(folder)
(folder / "conf.py").write_text(
    'extensions = ["sphinx_needs"]\nneeds_id_regex = "^[A-Za-z0-9_.-]+$"\nneeds_build_json = True\n'
)
(folder / "index.rst").write_text("Verdicts\n========\n\n.. needimport:: needs.json\n")
subprocess.run(
    [sys.executable, "-m", "sphinx", "-q", "-W", "-b", "needs", str(folder), str(folder / "built")], check=True
)
built = json.loads((folder / "built/needs.json").read_text())
needs = built["versions"][built["current_version"]]["needs"]
assert set(needs) == set(wanted), needs.keys()
for name, entry in wanted.items():
    assert needs[name]["title"] == entry["text"], needs[name]
    assert needs[name]["status"] == ("passed" if entry["met"] else "failed"), needs[name]
print(f"  {summary['scenario']}: {len(wanted)} requirements, {suite.failures} failures, read by all three")

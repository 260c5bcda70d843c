"""Print where the time of a test run went: seconds by folder, and the 20 slowest tests, from pytest's JUnit file."""

import sys
from collections import Counter
from xml.etree import ElementTree


def main(path: str) -> None:
    cases = [
        (case.get("classname", ""), case.get("name"), float(case.get("time", 0)))
        for case in ElementTree.parse(path).iter("testcase")
    ]
    folders, counts = Counter(), Counter()
    for place, _, seconds in cases:
        folder = "/".join(place.split(".")[:-1])
        folders[folder] += seconds
        counts[folder] += 1
    print("\nseconds  tests  folder")
    for folder, seconds in folders.most_common():
        print(f"{seconds:7.0f}  {counts[folder]:5}  {folder}")
    print("\nseconds  the slowest tests")
    for place, name, seconds in sorted(cases, key=lambda case: -case[2])[:20]:
        print(f"{seconds:7.1f}  {place.replace('.', '/')}.py::{name}")


if __name__ == "__main__":
    main(sys.argv[1])

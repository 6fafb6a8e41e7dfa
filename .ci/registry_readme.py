"""Make the README's own addresses absolute, for a page that does not stand beside its files.

Run as ``python .ci/registry_readme.py OWNER/NAME TAG`` before a release is built: pictures come
from the tag's files, everything else leads to the tag's pages, and it is installed by its name.
"""

import re
import sys
from pathlib import Path

README = Path(__file__).parents[1] / "README.md"
# What is said of getting it as long as it is on no registry.
FROM_ELSEWHERE = re.compile(r"It is on no registry yet\..*?\n\n    pip install [^\n]*\n", re.DOTALL)
OWN = re.compile(r"(!?)\[([^][]*)]\((?!https?:|#)([^)]+)\)")


def absolute(text: str, repository: str, tag: str) -> str:
    """Return the text of the README with absolute addresses of a repository's tag."""
    pictures = f"https://raw.githubusercontent.com/{repository}/{tag}"
    pages = f"https://github.com/{repository}/blob/{tag}"

    def placed(found: re.Match[str]) -> str:
        mark, words, path = found.groups()
        return f"{mark}[{words}]({pictures if mark else pages}/{path})"

    return FROM_ELSEWHERE.sub("    pip install slewctl\n", OWN.sub(placed, text))


if __name__ == "__main__":
    README.write_text(absolute(README.read_text("utf-8"), *sys.argv[1:]), "utf-8")

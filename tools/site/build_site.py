"""Write the pages of the site into build/docs, from which `make docs` makes site/: `python tools/site/build_site.py`.

The pages of this folder, as they are; the home, which is the first screen of the README; the gallery, with a page for
each machine; and the notebooks, with what their cells show. What needs no hand is made here, so that nothing is stale.
"""

from __future__ import annotations

import re
import shutil
import sys
from pathlib import Path

import cards
import gallery

import notebooks

DOCS = Path(__file__).resolve().parents[2] / "docs"
ROOT = DOCS.parent
SITE = ROOT / "build" / "docs"
IS_NO_PAGE = shutil.ignore_patterns("*.py", "__pycache__")
UNSEARCHED = ("decisions",)
"""Folders for developers, whose pages the search leaves out: they use every word that users look for."""
FOR_DEVELOPERS = ("CONTRIBUTING.md", "SECURITY.md")
OUTSIDE = re.compile(r"\]\(((?:\.\./)+)(notebooks/\w+\.ipynb|CONTRIBUTING\.md)\)")
HOME_ENDS = "\n## What it does not do yet"
PICTURE = re.compile(r"(!\[[^\]]*\])\((?!\w+:)([^)#\s]+\.(?:png|gif|webp))\)(?!\{)")
LINK = re.compile(r"(?<!!)\[([^\[\]]+)\]\((?!\w+:)([^)#\s]+)\)")
LIVE = re.compile(r"^<!-- live: (\w+)( without limits)? -->$", re.MULTILINE)
"""Where a page has a machine of the gallery on the site, or one without the limits of its joints."""


def main() -> None:
    """Write all pages anew."""
    shutil.rmtree(SITE, ignore_errors=True)
    shutil.copytree(DOCS, SITE, ignore=IS_NO_PAGE)
    for folder in UNSEARCHED:
        for page in (SITE / folder).glob("*.md"):
            page.write_text(f"---\nsearch:\n  exclude: true\n---\n{page.read_text('utf-8')}", encoding="utf-8")
    (SITE / "index.md").write_text(home((ROOT / "README.md").read_text(encoding="utf-8")), encoding="utf-8")
    gallery.write(SITE)
    notebooks.write(SITE)
    for name in FOR_DEVELOPERS:
        text = (ROOT / name).read_text(encoding="utf-8").replace("](docs/", "](").replace("](SECURITY", "](security")
        (SITE / name.lower()).write_text(text, encoding="utf-8")
    for page in SITE.rglob("*.md"):
        page.write_text(without_files(page, OUTSIDE.sub(_inside, marked(page))), encoding="utf-8")


def home(readme: str) -> str:
    """The first screen of the README as the home of the site: its text in one column, its film beside it."""
    screen = readme.partition(HOME_ENDS)[0].replace("](docs/", "](")
    first, lines, install, wishes = re.split(r"\n## .*\n", screen)
    title, sentence, film, caption = (part.strip() for part in first.strip().split("\n\n"))
    code, shown = re.findall(r"^```.*?^```$", lines, re.DOTALL | re.MULTILINE)
    after = lines.rpartition("```")[2].strip()
    return f"""---
title: pfabrik
hide: [navigation, toc]
---
<div class="hero" markdown>
<div markdown>
{title}

{sentence}
{{ .lead }}

[Start: five minutes](start.md){{ .md-button .md-button--primary }}
[Drag a machine](gallery.md){{ .md-button }}
</div>
<figure markdown>
{film}
<figcaption markdown>{caption.strip("*")}</figcaption>
</figure>
</div>

## Six lines

{code}

{shown}

{after}

## Install

{install.strip()}

## What do you have?

<div class="wishes" markdown>
{cards.grid(wishes.strip(), SITE)}
</div>
"""


def _inside(found: re.Match[str]) -> str:
    """A link out of the folder of pages, to a notebook or a page for developers, as one to its page of the site."""
    up, name = found[1].removeprefix("../"), found[2]
    return f"]({up}{name.removesuffix('.ipynb') + '.md' if name.endswith('.ipynb') else name.lower()})"


def without_files(page: Path, text: str) -> str:
    """The text of a page, in which names of files that the site does not have, such as programs, are no links."""

    def plain(found: re.Match[str]) -> str:
        if (page.parent / found[2]).exists():
            return found[0]
        source = DOCS / page.parent.relative_to(SITE)
        return found[1] if any((folder / found[2]).exists() for folder in (source, ROOT)) else found[0]

    return LINK.sub(plain, text)


def marked(page: Path) -> str:
    """A page whose pictures suit light and dark pages: by a second one, or a note that they are on white."""

    def mark(found: re.Match[str]) -> str:
        path, text = page.parent / found[2], found[1]
        if not path.exists():
            return found[0]
        dark = path.with_name(f"{path.stem}-dark{path.suffix}")
        if dark.exists():
            name = f"{found[2].removesuffix(path.suffix)}-dark{path.suffix}"
            return f"{text}({found[2]}#only-light){{ loading=lazy }}{text}({name}#only-dark){{ loading=lazy }}"
        return found[0] + "{ .on-white loading=lazy }" * cards.is_on_white(path)

    text = PICTURE.sub(mark, page.read_text(encoding="utf-8"))
    up = "../" * (len(page.relative_to(SITE).parts) - 1)

    def live(found: re.Match[str]) -> str:
        name, without = found[1], found[2] or ""
        file = gallery.write_free(name, SITE) if without else name
        return gallery.frame(file, gallery.title(name) + without, f"{up}gallery/")

    return LIVE.sub(live, text)


if __name__ == "__main__":
    main()
    sys.stderr.write(f"{sum(1 for _ in SITE.rglob('*.md'))} pages in {SITE.relative_to(ROOT)}\n")

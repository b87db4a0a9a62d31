"""Formulas: `$…$` in a line and `$$…$$` as a display become MathML, which browsers draw by themselves."""

import re

from latex2mathml.converter import convert
from markdown import Extension
from markdown.inlinepatterns import InlineProcessor
from markdown.preprocessors import Preprocessor


def mathml(latex, display):
    """The MathML of a formula; a formula that is none ends the build with its text."""
    # The converter knows the one and not the other; both line equations up, and neither numbers them.
    known = latex.strip().replace("{aligned}", "{split}")
    try:
        html = convert(known, display=display)
    except Exception as error:
        raise ValueError(f"the formula {latex!r} cannot be read: {error!r}") from error
    # A command that is not known is set as it stands.
    if "\\" in html or "&#x0005C;" in html or "<mi>&</mi>" in html:
        raise ValueError(f"the formula {latex!r} has a command that cannot be set as MathML")
    return html


class Displays(Preprocessor):
    DISPLAY = re.compile(r"^\$\$\s*(.+?)\s*\$\$$", re.MULTILINE | re.DOTALL)

    def run(self, lines):
        def stored(match):
            html = f'<div class="formula">{mathml(match.group(1), "block")}</div>'
            return f"\n\n{self.md.htmlStash.store(html)}\n\n"

        return self.DISPLAY.sub(stored, "\n".join(lines)).split("\n")


class Inline(InlineProcessor):
    def handleMatch(self, match, data):
        return self.md.htmlStash.store(mathml(match.group(1), "inline")), match.start(0), match.end(0)


class Formulas(Extension):
    def extendMarkdown(self, md):
        # Behind fenced code (25) and code in a line (190), whose dollars are a shell's.
        md.preprocessors.register(Displays(md), "displays", 22)
        md.inlinePatterns.register(Inline(r"\$([^$\n]+?)\$", md), "formulas", 185)


def on_config(config):
    config["markdown_extensions"].append(Formulas())
    return config

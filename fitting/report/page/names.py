"""Effects and parameters on the page: the name for readers first, the identifier small beside it."""

from html import escape

from markupsafe import Markup

from fitting.report.text.names import MARKED, Names

SEVERAL = 3  # names in a headline: identifiers between them make it hard to read
LONG = 16  # characters: an identifier that a narrow column may have to break, which it then does where words end


def _breaking(name: str) -> str:
    return name.replace("_", "_<wbr>").replace(".", ".<wbr>") if len(name) >= LONG else name


class PageNames(Names):
    """Names of a library as HTML."""

    def html(self, text: str) -> Markup:
        """The text as HTML with the name for readers and a small identifier for every name; the rest is escaped."""
        return Markup(self.replaced(text, self._html, escape))  # escaped part by part

    def headline(self, text: str) -> Markup:
        """The same for a headline: of several names no identifiers, which stand in the sentences below."""
        return self.html(text) if len(MARKED.findall(text)) < SEVERAL else Markup(escape(self.plain(text)))

    def _html(self, name: str) -> str:
        called = self.called(name)
        small = f'<small class="id">{_breaking(escape(name))}</small>'
        return small if called == name else f"{escape(called)} {small}"

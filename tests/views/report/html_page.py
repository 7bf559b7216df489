"""Parse a page in the way of a screen reader."""

from html.parser import HTMLParser

VOID = {"meta", "img", "input", "line", "polyline"}


class Page(HTMLParser):
    """A page as a screen reader sees it: elements, ids, and texts by element."""

    def __init__(self, html):
        super().__init__()
        self.elements, self.ids, self.open, self.words = [], [], [], {}
        self.feed(html)
        self.close()
        assert not self.open, f"left open: {self.open}"

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        self.ids += [value for name, value in attrs if name == "id"]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        assert self.open.pop() == tag, tag

    def handle_data(self, data):
        self.words.setdefault(self.open[-1] if self.open else "", []).append(data)

    @property
    def text(self):
        shown = (words for tag, words in self.words.items() if tag not in ("style", "script"))
        return " ".join(" ".join(part.split()) for words in shown for part in words if part.strip())

    def all(self, tag):
        return [attrs for name, attrs in self.elements if name == tag]

    def said(self, tag):
        return [" ".join(part.split()) for part in self.words.get(tag, ()) if part.strip()]

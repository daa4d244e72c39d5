"""A reading of our docstrings for the reference: `focal : focal length, px` says no type.

Where a docstring has only a type and not the one of the code, that text is a description, and the
code's own type stands beside it.
"""

from collections.abc import Iterator

import griffe

KINDS = griffe.DocstringSectionKind
TYPED = (KINDS.parameters, KINDS.attributes, KINDS.returns)


class Dialect(griffe.Extension):
    """Moves such texts, once a package is read."""

    def on_package(self, *, pkg: griffe.Module, **_) -> None:
        """Look through the whole package."""
        for thing in _inside(pkg):
            for section in thing.docstring.parsed if thing.docstring else ():
                if section.kind in TYPED:
                    _describe(section.value, thing)


def _inside(thing: griffe.Object) -> Iterator[griffe.Object]:
    """Give an object and all that it holds itself."""
    yield thing
    for member in thing.members.values():
        if not member.is_alias:
            yield from _inside(member)


def _describe(elements: list, thing: griffe.Object) -> None:
    for element in elements:
        own = _annotation(thing, element.name)
        if not element.description and str(element.annotation) != str(own):
            element.description, element.annotation = str(element.annotation), own


def _annotation(thing: griffe.Object, name: str):
    """Return the type that the code gives a parameter, an attribute or what is returned."""
    if not thing.is_function:
        member = thing.members.get(name)
        return getattr(member, "annotation", None) or getattr(member, "returns", None)
    if name not in thing.parameters:
        return None if name else thing.returns
    return thing.parameters[name].annotation

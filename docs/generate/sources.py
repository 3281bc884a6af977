"""What the package and its tests say and use: docstrings, citations and names, read as text.

Nothing is imported. Names are resolved as a reader would: a name by the file's own definitions and
imports, an attribute by the definitions of that name. Tests reach a function directly, by its name,
or through other functions; a chain of names is no proof that a line runs, but without one it does
not.
"""

from __future__ import annotations

import ast
import re
from collections import defaultdict, deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

CITATION = re.compile(r"(?<![\w)\]'])\((\d{1,2}|[ABC]\.\d{1,2})\)(?:-\(((?:[ABC]\.)?\d{1,2})\))?")
REFERENCE = re.compile(
    r"((?:(?:[Dd]u|af|de|van|von) )?[A-Z][A-Za-z]+(?:, [A-Z][A-Za-z]+)*"
    r"(?: & [A-Z][A-Za-z]+| et al\.)?)"
    r",? \(?((?:19|20)\d\d)\)?"
)
_MOST_ALIKE = 2  # an attribute with more definitions than this names none of them
_NOT_NAMES = frozenset({"None", "True", "False", "self", "cls"})


@dataclass(frozen=True)
class Definition:
    """A module, class, function, method or constant, or a test.

    Attributes
    ----------
    file
        Path from the root of the repository.
    name
        Qualified name in the file, empty for the module itself.
    docstring
        As written, with the string constants that cite (`citation = "..."`).
    uses
        Names and attributes that its body mentions.
    """

    file: str
    name: str
    docstring: str
    uses: frozenset[str] = field(repr=False)

    @property
    def key(self) -> str:
        """Return what it is called on the page and in messages."""
        return f"{self.file}::{self.name}" if self.name else self.file

    @property
    def simple(self) -> str:
        """The last part of the name."""
        return self.name.rsplit(".", 1)[-1]

    @property
    def equations(self) -> tuple[str, ...]:
        """Numbers of equations that the docstring cites, each once, in order of appearance."""
        return tuple(dict.fromkeys(cited(self.docstring)))


def references(text: str) -> tuple[str, ...]:
    """Return the references that `text` cites, e.g. ``"Hasimoto 1959"``, in order of appearance."""
    found = (f"{names} {year}" for names, year in REFERENCE.findall(" ".join(text.split())))
    return tuple(dict.fromkeys(re.sub("^Du ", "du ", one) for one in found))


def cited(text: str) -> Iterator[str]:
    """Yield the equation numbers in `text`, with ranges such as (A.1)-(A.4) written out."""
    for first, last in CITATION.findall(text):
        if not last:
            yield first
            continue
        front, low = first.rpartition(".")[::2]
        high = int(last.rpartition(".")[2])
        for number in range(int(low), high + 1):
            yield f"{front}.{number}" if front else str(number)


@dataclass(frozen=True)
class Source:
    """One file: its definitions and what it imports.

    Attributes
    ----------
    path
        From the root of the repository.
    definitions
        The module first.
    imported
        Modules and names that it imports, as dotted names.
    strings
        All string constants, docstrings included, one after another.
    """

    path: str
    definitions: tuple[Definition, ...]
    imported: frozenset[str]
    strings: str


def read(root: Path, folder: str) -> list[Source]:
    """Return all Python files below `folder`, sorted by path."""
    return [_source(root, path) for path in sorted((root / folder).rglob("*.py"))]


def _source(root: Path, path: Path) -> Source:
    tree = ast.parse(path.read_text(encoding="utf-8"), str(path))
    file = path.relative_to(root).as_posix()
    own = _uses(node for node in tree.body if not isinstance(node, ast.FunctionDef | ast.ClassDef))
    whole = ast.get_docstring(tree) or ""
    found = [Definition(file, "", whole, own), *_definitions(tree, file, "")]
    constants = (n.value for n in ast.walk(tree) if isinstance(n, ast.Constant))
    strings = " ; ".join(value for value in constants if isinstance(value, str))
    return Source(file, tuple(found), frozenset(_imported(tree)), strings)


def _definitions(parent: ast.AST, file: str, front: str) -> Iterator[Definition]:
    for node in ast.iter_child_nodes(parent):
        if isinstance(node, ast.Assign) and not front:
            for target in node.targets:
                for name in ast.walk(target):
                    if isinstance(name, ast.Name):
                        yield Definition(file, name.id, "", _uses([node.value]))
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            name = f"{front}{node.name}"
            inner = [] if isinstance(node, ast.FunctionDef) else node.body
            text = "\n".join([ast.get_docstring(node) or "", *_stated(inner)])
            yield Definition(file, name, text, _uses([node]))
            if isinstance(node, ast.ClassDef):
                yield from _definitions(node, file, f"{name}.")


def _stated(body: Iterable[ast.stmt]) -> Iterator[str]:
    """Yield the strings that a class holds as ``citation = ...``."""
    for node in body:
        if not (isinstance(node, ast.AnnAssign) and isinstance(node.value, ast.Constant)):
            continue
        if isinstance(node.target, ast.Name) and node.target.id == "citation":
            yield str(node.value.value)


def _uses(nodes: Iterable[ast.AST]) -> frozenset[str]:
    """Return names as they are, attributes with a point in front, short strings in quotes."""
    found = set()
    for top in nodes:
        for node in ast.walk(top):
            if isinstance(node, ast.Name):
                found.add(node.id)
            elif isinstance(node, ast.Attribute):
                found.add(f".{node.attr}")
            elif isinstance(node, ast.arg):
                found.add(node.arg)  # a test's parameter is a fixture
            elif isinstance(node, ast.Constant) and str(node.value).isidentifier():
                found.add(f"'{node.value}'")
    return frozenset(found - _NOT_NAMES)


def _imported(tree: ast.AST) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


@dataclass(frozen=True)
class Graph:
    """Who mentions whom, in the package and its tests."""

    sources: tuple[Source, ...]
    by_key: dict[str, Definition]
    users: dict[str, list[str]]

    @classmethod
    def of(cls, sources: Iterable[Source]) -> Graph:
        """Resolve the names of all `sources`."""
        held = tuple(sources)
        by_key = {one.key: one for source in held for one in source.definitions}
        by_name: dict[str, list[Definition]] = defaultdict(list)
        for one in by_key.values():
            by_name[one.simple if one.name else f"'{Path(one.file).stem}'"].append(one)
        users: dict[str, list[str]] = defaultdict(list)
        for source in held:
            for user in source.definitions:
                for target in _resolved(user, source, by_name):
                    users[target].append(user.key)
        return cls(held, by_key, dict(users))

    def reaching(self, key: str) -> list[tuple[str, int]]:
        """Return the tests that reach a definition, and how many names on, the nearest first."""
        distance, queue = {key: 0}, deque([key])
        while queue:
            now = queue.popleft()
            for user in self.users.get(now, ()):
                if user not in distance:
                    distance[user] = distance[now] + 1
                    queue.append(user)
        tests = [(k, d) for k, d in distance.items() if _is_test(self.by_key[k])]
        return sorted(tests, key=lambda pair: (pair[1], pair[0]))


def _is_test(one: Definition) -> bool:
    return one.file.startswith("tests/") and one.simple.startswith("test_") and bool(one.name)


def _resolved(
    user: Definition, source: Source, by_name: dict[str, list[Definition]]
) -> Iterator[str]:
    """Yield the keys of what `user` mentions."""
    for name in user.uses:
        if name.startswith("'"):
            # an experiment by its name: its module is imported when it is run
            for one in by_name.get(name, ()):
                if "/experiments/" in one.file and one.file.startswith("src/"):
                    yield from (f"{one.file}::{part}" for part in ("run", "figure", "check"))
            continue
        found = [one for one in by_name.get(name.lstrip("."), ()) if one.key != user.key]
        near = [one for one in found if one.file == source.path or _is_imported(one, source)]
        if name.startswith("."):
            chosen = near or (found if len(found) <= _MOST_ALIKE else [])
        else:
            chosen = near
        for one in chosen:
            yield one.key
            if one.name and "." not in one.name:
                yield from _made(one, by_name)


def _made(one: Definition, by_name: dict[str, list[Definition]]) -> Iterator[str]:
    """Yield what making an object of a class calls by itself."""
    for method in ("__init__", "__post_init__"):
        for other in by_name.get(method, ()):
            if other.key == f"{one.key}.{method}":
                yield other.key


def _is_imported(one: Definition, source: Source) -> bool:
    module = one.file.removeprefix("src/").removeprefix("tests/").removesuffix(".py")
    dotted = module.removesuffix("/__init__").replace("/", ".")
    if dotted in source.imported or f"{dotted}.{one.name}" in source.imported:
        return True
    # by the package that it is a part of, which exports it
    package = dotted.rpartition(".")[0]
    inside = package.count(".") > 0 and package in source.imported
    return f"{package}.{one.name}" in source.imported or inside

"""Preprocessed C files as trees, and what the passes over them share."""

from __future__ import annotations

from dataclasses import dataclass, field

from pycparser import c_ast, c_parser

Path = tuple[str, ...]
UNKNOWN: Path = ()  # several addresses, or none that is constant


@dataclass(frozen=True)
class Split:
    """An object whose members become objects of their own."""

    name: str
    type: str
    far: dict[str, int] = field(default_factory=dict)  # members larger than a bank: their linear addresses


@dataclass
class Unit:
    """One preprocessed file."""

    name: str
    tree: c_ast.FileAST
    functions: dict[str, c_ast.FuncDef] = field(default_factory=dict)


class SpecialiseError(ValueError):
    """The sources use the split object in a way that this pass cannot rewrite."""


def parse(name: str, text: str) -> Unit:
    """`text`: the preprocessed file; static functions are renamed NAME_function."""
    unit = Unit(name, c_parser.CParser().parse(text, name))
    _mark_indices(unit.tree)
    statics = {}
    for node in unit.tree.ext:
        declaration = node.decl if isinstance(node, c_ast.FuncDef) else node
        if is_function(declaration) and "static" in declaration.storage and "inline" not in declaration.funcspec:
            statics[declaration.name] = f"{name}_{declaration.name}"
            declaration.storage.remove("static")
    _rename(unit.tree, statics)
    for node in unit.tree.ext:
        if isinstance(node, c_ast.FuncDef):
            unit.functions[node.decl.name] = node
    return unit


def _mark_indices(tree: c_ast.Node) -> None:
    """`[NAME] = value` of an array, which pycparser would write as `.NAME = value`."""
    enumerators = {node.name for node in walk(tree) if isinstance(node, c_ast.Enumerator)}
    for node in walk(tree):
        if isinstance(node, c_ast.NamedInitializer):
            node.name = [
                c_ast.Constant("int", name.name) if isinstance(name, c_ast.ID) and name.name in enumerators else name
                for name in node.name
            ]


def _rename(tree: c_ast.Node, names: dict[str, str]) -> None:
    members = {id(node.field) for node in walk(tree) if isinstance(node, c_ast.StructRef)}
    for node in walk(tree):
        if isinstance(node, c_ast.ID) and node.name in names and id(node) not in members:
            node.name = names[node.name]
        elif isinstance(node, c_ast.Decl) and isinstance(node.type, c_ast.FuncDecl) and node.name in names:
            node.type.type.declname = names[node.name]
            node.name = names[node.name]


def walk(node: c_ast.Node) -> list[c_ast.Node]:
    """A node and all below it, in the order of the source."""
    found = [node]
    for _, child in node.children():
        found.extend(walk(child))
    return found


def parameters_of(function: c_ast.FuncDef) -> list[c_ast.Decl]:
    """The declarations of a function's parameters."""
    arguments = function.decl.type.args
    return [p for p in arguments.params if isinstance(p, c_ast.Decl)] if arguments is not None else []


def declared_in(function: c_ast.FuncDef) -> set[str]:
    """Names that a function declares."""
    return {node.name for node in walk(function) if isinstance(node, c_ast.Decl)}


def is_function(node: c_ast.Node) -> bool:
    """Whether a declaration is that of a function."""
    return isinstance(node, c_ast.Decl) and isinstance(node.type, c_ast.FuncDecl)

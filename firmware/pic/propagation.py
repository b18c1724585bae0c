"""Which parameters and members hold one address all through a program."""

from __future__ import annotations

from typing import Any

from pycparser import c_ast
from units import UNKNOWN, Path, SpecialiseError, Split, Unit, declared_in, parameters_of, walk


class Program:
    """All units of a program, and what is known of its pointers."""

    def __init__(self, units: list[Unit], split: Split, root: str) -> None:
        """`root`: the function, without parameters, that the chip's main calls."""
        self.units = units
        self.split = split
        self.functions = {name: f for unit in units for name, f in unit.functions.items()}
        self.locals = {name: declared_in(f) for name, f in self.functions.items()}
        self.reachable = self._find_reachable(root)
        self.structures, self.objects = self._find_types()
        self.fields: dict[Path, Path | None] = {}  # pointer members by the object's path; None: not set yet
        self.parameters: dict[tuple[str, str], Path | None] = {}  # None: not seen yet
        for name in self.reachable:
            for parameter in parameters_of(self.functions[name]):
                if isinstance(parameter.type, (c_ast.PtrDecl, c_ast.ArrayDecl)):
                    self.parameters[name, parameter.name] = None
        self._drop_assigned_parameters()
        self._propagate()
        self.members_of_any = self._members_of_any()
        self.dropped = {n: [self.bound(n, p.name) for p in parameters_of(self.functions[n])] for n in self.reachable}

    def _find_types(self) -> tuple[dict[str, dict[str, c_ast.Decl]], dict[str, c_ast.Decl]]:
        """Members of every named structure, and the objects of the whole program."""
        structures: dict[str, dict[str, c_ast.Decl]] = {}
        objects: dict[str, c_ast.Decl] = {}
        for node in (n for unit in self.units for n in unit.tree.ext):
            if isinstance(node, c_ast.Typedef) and isinstance(node.type.type, c_ast.Struct):
                structures[node.name] = {m.name: m for m in node.type.type.decls or []}
            elif isinstance(node, c_ast.Decl) and not isinstance(node.type, c_ast.FuncDecl):
                objects[node.name] = node
        return structures, objects

    def kind(self, path: Path) -> c_ast.Node | None:
        """The type of an object."""
        node = self.objects.get(path[0]) if path else None
        for member in path[1:]:
            inner = node.type.type if node is not None and isinstance(node.type, c_ast.TypeDecl) else None
            name = inner.names[0] if isinstance(inner, c_ast.IdentifierType) else ""
            node = self.structures.get(name, {}).get(member)
        return node.type if node is not None else None

    def pointer(self, path: Path) -> Path | None:
        """What a pointer member of a known object points to."""
        return self.fields.get(path)

    def _members_of_any(self) -> set[str]:
        """Names of the members that are used through pointers of no fixed address: these have to stay and be set."""
        return {
            node.field.name
            for name in self.reachable
            for node in walk(self.functions[name].body)
            if isinstance(node, c_ast.StructRef) and not self.place(name, node)
        }

    def _find_reachable(self, root: str) -> list[str]:
        found: list[str] = []
        todo = [root]
        while todo:
            name = todo.pop()
            if name not in found and name in self.functions:
                found.append(name)
                todo += [n.name for n in walk(self.functions[name].body) if isinstance(n, c_ast.ID)]
        return found

    def _drop_assigned_parameters(self) -> None:
        for name in self.reachable:
            for node in walk(self.functions[name].body):
                target = node.lvalue if isinstance(node, c_ast.Assignment) else None
                if isinstance(node, c_ast.UnaryOp) and node.op in ("++", "--", "p++", "p--"):
                    target = node.expr
                if isinstance(target, c_ast.ID) and (name, target.name) in self.parameters:
                    self.parameters[name, target.name] = UNKNOWN

    def value(self, function: str, node: c_ast.Node) -> Path | None:
        """The constant address that an expression has; None while its parts are not seen yet."""
        if isinstance(node, c_ast.ID):
            return self.parameters.get((function, node.name), UNKNOWN)
        if isinstance(node, c_ast.UnaryOp) and node.op == "&":
            return self.place(function, node.expr)
        place = self.place(function, node)
        if not place:
            return place
        kind = self.kind(place)
        if isinstance(kind, c_ast.PtrDecl):
            return self.pointer(place)
        return place if isinstance(kind, c_ast.ArrayDecl) else UNKNOWN  # an array is its own address

    def place(self, function: str, node: c_ast.Node) -> Path | None:
        """The object that an expression names, where that is one fixed object."""
        if isinstance(node, c_ast.ID):
            return UNKNOWN if node.name in self.locals[function] or node.name in self.functions else (node.name,)
        if isinstance(node, c_ast.StructRef):
            base = (self.value if node.type == "->" else self.place)(function, node.name)
            return (*base, node.field.name) if base else base
        return UNKNOWN

    def _propagate(self) -> None:
        changed = True
        while changed:
            changed = False
            for name in self.reachable:
                for node in walk(self.functions[name].body):
                    if isinstance(node, c_ast.FuncCall) and isinstance(node.name, c_ast.ID):
                        changed |= self._meet_call(name, node)
                    elif isinstance(node, c_ast.Assignment) and isinstance(node.lvalue, c_ast.StructRef):
                        changed |= self._meet_field(name, node)

    def _meet_call(self, caller: str, call: c_ast.FuncCall) -> bool:
        callee = self.functions.get(call.name.name)
        if callee is None or call.args is None:
            return False
        changed = False
        for parameter, argument in zip(parameters_of(callee), call.args.exprs, strict=False):
            key = (call.name.name, parameter.name)
            if key in self.parameters:
                changed |= _meet(self.parameters, key, self.value(caller, argument))
        return changed

    def _meet_field(self, function: str, node: c_ast.Assignment) -> bool:
        place = self.place(function, node.lvalue)
        if not place or not isinstance(self.kind(place), c_ast.PtrDecl):
            return False
        self.fields.setdefault(place, None)
        return _meet(self.fields, place, self.value(function, node.rvalue))

    def bound(self, function: str, parameter: str) -> bool:
        """Whether a parameter always holds the same address."""
        return bool(self.parameters.get((function, parameter)))

    @property
    def split_members(self) -> list[c_ast.Decl]:
        """The members of the split object."""
        for unit in self.units:
            for node in unit.tree.ext:
                if isinstance(node, c_ast.Typedef) and node.name == self.split.type:
                    return list(node.type.type.decls)
        raise SpecialiseError(f"no structure {self.split.type}")

    def is_object(self, member: str) -> bool:
        """Whether a member of the split object is left: a pointer with a known address is not."""
        return not self.fields.get((self.split.name, member)) or member in self.members_of_any

    def name_of(self, path: Path) -> c_ast.Node:
        """The expression for an object: members of the split object have names of their own."""
        if path[0] == self.split.name and len(path) > 1:
            node: c_ast.Node = c_ast.ID(f"{path[0]}_{path[1]}")
            rest = path[2:]
        else:
            node = c_ast.ID(path[0])
            rest = path[1:]
        for member in rest:
            node = c_ast.StructRef(node, ".", c_ast.ID(member))
        return node


def _meet(table: dict[Any, Path | None], key: object, value: Path | None) -> bool:
    if value is None or table[key] == UNKNOWN:
        return False
    new = value if table[key] in (None, value) else UNKNOWN
    changed = bool(table[key] != new)
    table[key] = new
    return changed

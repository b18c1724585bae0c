"""Whole-program constant propagation of pointers, which SDCC lacks, from C99 to C99.

The core takes its state by pointers (`scheduler *s`), so that tests can have many of each. The chip's program has one
of each. SDCC's pic14 port makes every access through a pointer a call of 25 cycles, a direct one takes one or two.
This pass finds parameters and members that hold the same address at every place that sets them, drops them, and
writes the address's object in their stead: `s->due_us[job]` becomes `the_board_slots.due_us[job]`. Members of the
split object (the board: too large for a bank of 80 bytes) become objects of their own. Functions that cannot be
reached are left out, static ones get the name of their file and are no longer static, so that SDCC does not inline
them into one that fills a page.

What the pass does not understand it leaves as it is, which is slower but as right.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass, field
from typing import Any

from pycparser import c_ast, c_generator, c_parser

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
        if _is_function(declaration) and "static" in declaration.storage and "inline" not in declaration.funcspec:
            statics[declaration.name] = f"{name}_{declaration.name}"
            declaration.storage.remove("static")
    _rename(unit.tree, statics)
    for node in unit.tree.ext:
        if isinstance(node, c_ast.FuncDef):
            unit.functions[node.decl.name] = node
    return unit


def _mark_indices(tree: c_ast.Node) -> None:
    """`[NAME] = value` of an array, which pycparser would write as `.NAME = value`."""
    enumerators = {node.name for node in _walk(tree) if isinstance(node, c_ast.Enumerator)}
    for node in _walk(tree):
        if isinstance(node, c_ast.NamedInitializer):
            node.name = [
                c_ast.Constant("int", name.name) if isinstance(name, c_ast.ID) and name.name in enumerators else name
                for name in node.name
            ]


def _rename(tree: c_ast.Node, names: dict[str, str]) -> None:
    members = {id(node.field) for node in _walk(tree) if isinstance(node, c_ast.StructRef)}
    for node in _walk(tree):
        if isinstance(node, c_ast.ID) and node.name in names and id(node) not in members:
            node.name = names[node.name]
        elif isinstance(node, c_ast.Decl) and isinstance(node.type, c_ast.FuncDecl) and node.name in names:
            node.type.type.declname = names[node.name]
            node.name = names[node.name]


def _walk(node: c_ast.Node) -> list[c_ast.Node]:
    found = [node]
    for _, child in node.children():
        found.extend(_walk(child))
    return found


def _parameters(function: c_ast.FuncDef) -> list[c_ast.Decl]:
    arguments = function.decl.type.args
    return [p for p in arguments.params if isinstance(p, c_ast.Decl)] if arguments is not None else []


def _declared(function: c_ast.FuncDef) -> set[str]:
    return {node.name for node in _walk(function) if isinstance(node, c_ast.Decl)}


class Program:
    """All units of a program, and what is known of its pointers."""

    def __init__(self, units: list[Unit], split: Split, root: str) -> None:
        """`root`: the function, without parameters, that the chip's main calls."""
        self.units = units
        self.split = split
        self.functions = {name: f for unit in units for name, f in unit.functions.items()}
        self.locals = {name: _declared(f) for name, f in self.functions.items()}
        self.reachable = self._find_reachable(root)
        self.structures, self.objects = self._find_types()
        self.fields: dict[Path, Path | None] = {}  # pointer members by the object's path; None: not set yet
        self.parameters: dict[tuple[str, str], Path | None] = {}  # None: not seen yet
        for name in self.reachable:
            for parameter in _parameters(self.functions[name]):
                if isinstance(parameter.type, (c_ast.PtrDecl, c_ast.ArrayDecl)):
                    self.parameters[name, parameter.name] = None
        self._drop_assigned_parameters()
        self._propagate()
        self.members_of_any = self._members_of_any()
        self.dropped = {n: [self.bound(n, p.name) for p in _parameters(self.functions[n])] for n in self.reachable}

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
            for node in _walk(self.functions[name].body)
            if isinstance(node, c_ast.StructRef) and not self.place(name, node)
        }

    def _find_reachable(self, root: str) -> list[str]:
        found: list[str] = []
        todo = [root]
        while todo:
            name = todo.pop()
            if name not in found and name in self.functions:
                found.append(name)
                todo += [n.name for n in _walk(self.functions[name].body) if isinstance(n, c_ast.ID)]
        return found

    def _drop_assigned_parameters(self) -> None:
        for name in self.reachable:
            for node in _walk(self.functions[name].body):
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
                for node in _walk(self.functions[name].body):
                    if isinstance(node, c_ast.FuncCall) and isinstance(node.name, c_ast.ID):
                        changed |= self._meet_call(name, node)
                    elif isinstance(node, c_ast.Assignment) and isinstance(node.lvalue, c_ast.StructRef):
                        changed |= self._meet_field(name, node)

    def _meet_call(self, caller: str, call: c_ast.FuncCall) -> bool:
        callee = self.functions.get(call.name.name)
        if callee is None or call.args is None:
            return False
        changed = False
        for parameter, argument in zip(_parameters(callee), call.args.exprs, strict=False):
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


class _Rewriter:
    """Replaces known addresses in one function."""

    def __init__(self, program: Program, function: str, members: list[str]) -> None:
        self.program = program
        self.function = function
        self.members = members

    def rewrite(self, node: c_ast.Node) -> c_ast.Node:
        if isinstance(node, c_ast.FuncCall) and isinstance(node.name, c_ast.ID):
            split = self._memset_of_split(node)
            if split is not None:
                return split
        if isinstance(node, c_ast.Assignment) and isinstance(node.lvalue, c_ast.StructRef):
            target = self.program.place(self.function, node.lvalue)
            node.lvalue = self.program.name_of(target) if target else self.rewrite(node.lvalue)
            node.rvalue = self.rewrite(node.rvalue)
            return node
        place = self.program.place(self.function, node) if isinstance(node, c_ast.StructRef) else UNKNOWN
        if place and self.program.pointer(place):
            place = UNKNOWN  # the member itself, not what it points to
        if isinstance(node, c_ast.StructRef) and place:
            return self.program.name_of(place)
        if isinstance(node, (c_ast.ID, c_ast.StructRef)):
            address = self.program.value(self.function, node)
            if address and not (isinstance(node, c_ast.ID) and not self._is_bound(node)):
                return self._address(address)
        if isinstance(node, c_ast.FuncCall) and isinstance(node.name, c_ast.ID) and node.args is not None:
            self._drop_arguments(node)
        for name, child in node.children():
            _replace(node, name, self.rewrite(child))
        return node

    def _is_bound(self, node: c_ast.ID) -> bool:
        return self.program.bound(self.function, node.name)

    def _address(self, path: Path) -> c_ast.Node:
        if path == (self.program.split.name,):
            raise SpecialiseError(f"{self.function}: the whole of {path[0]} is used as an object")
        named = self.program.name_of(path)
        return named if isinstance(self.program.kind(path), c_ast.ArrayDecl) else c_ast.UnaryOp("&", named)

    def _drop_arguments(self, call: c_ast.FuncCall) -> None:
        dropped = self.program.dropped.get(call.name.name, [])
        if any(dropped):
            kept = [argument for argument, drop in zip(call.args.exprs, dropped, strict=True) if not drop]
            call.args = c_ast.ExprList(kept) if kept else None

    def _memset_of_split(self, call: c_ast.FuncCall) -> c_ast.Node | None:
        if call.name.name != "memset" or self.program.value(self.function, call.args.exprs[0]) != (
            self.program.split.name,
        ):
            return None
        calls: list[c_ast.Node] = []
        for member in self.members:
            target = c_ast.ID(f"{self.program.split.name}_{member}")
            arguments = [c_ast.UnaryOp("&", target), call.args.exprs[1], c_ast.UnaryOp("sizeof", target)]
            calls.append(c_ast.FuncCall(c_ast.ID("memset"), c_ast.ExprList(arguments)))
        return c_ast.ExprList(calls)


def _replace(node: c_ast.Node, name: str, child: c_ast.Node) -> None:
    if "[" in name:
        attribute, index = name[:-1].split("[")
        getattr(node, attribute)[int(index)] = child
    else:
        setattr(node, name, child)


def _object(split: Split, member: c_ast.Decl) -> c_ast.Decl:
    made = copy.deepcopy(member)
    made.name = f"{split.name}_{member.name}"
    inner = made.type
    while not isinstance(inner, c_ast.TypeDecl):
        inner = inner.type
    inner.declname = made.name
    return made


def _drop_field_writes(program: Program, function: str, body: c_ast.Node) -> None:
    def is_dead(item: c_ast.Node) -> bool:
        if not isinstance(item, c_ast.Assignment) or not isinstance(item.lvalue, c_ast.StructRef):
            return False
        known = bool(program.pointer(program.place(function, item.lvalue) or UNKNOWN))
        return known and item.lvalue.field.name not in program.members_of_any

    for node in _walk(body):
        if isinstance(node, c_ast.Compound) and node.block_items:
            node.block_items = [item for item in node.block_items if not is_dead(item)]


def _strip_parameters(program: Program, name: str, declaration: c_ast.Decl) -> None:
    arguments = declaration.type.args
    dropped = program.dropped[name]
    if arguments is not None and dropped:
        kept = [p for p, drop in zip(arguments.params, dropped, strict=True) if not drop]
        void = c_ast.Typename(None, [], None, c_ast.TypeDecl(None, [], None, c_ast.IdentifierType(["void"])))
        declaration.type.args = c_ast.ParamList(kept or [void])


def _is_function(node: c_ast.Node) -> bool:
    return isinstance(node, c_ast.Decl) and isinstance(node.type, c_ast.FuncDecl)


def _merged(program: Program) -> list[list[c_ast.Node]]:
    """Every declaration once: types, declarations and objects, functions; in the order of the files."""
    seen: set[str] = set()
    types: list[c_ast.Node] = []
    objects: list[c_ast.Node] = []
    functions: list[c_ast.Node] = []
    generator = c_generator.CGenerator()
    for node in (n for unit in program.units for n in unit.tree.ext):
        declaration = node.decl if isinstance(node, c_ast.FuncDef) else node
        named = declaration.name if isinstance(declaration, c_ast.Decl) else None
        if named == program.split.name or (named in program.functions and named not in program.reachable):
            continue
        text = generator.visit(node)
        if text in seen:
            continue
        seen.add(text)
        if isinstance(node, c_ast.FuncDef):
            functions.append(node)
        elif isinstance(node, c_ast.Typedef) or getattr(node, "name", None) is None:
            types.append(node)
        else:
            objects.append(node)
    return [types, objects, functions]


def _far_macro(split: Split, member: c_ast.Decl) -> str:
    """An array at a linear address, as a pointer to its elements: it is only ever indexed."""
    if member.name not in split.far:
        return ""
    element = copy.deepcopy(member.type.type)
    inner = element
    while not isinstance(inner, c_ast.TypeDecl):
        inner = inner.type
    inner.declname = None
    pointer = c_generator.CGenerator().visit(c_ast.Typename(None, [], None, c_ast.PtrDecl([], element)))
    return f"#define {split.name}_{member.name} (({pointer.replace('*', '__data *')})0x{split.far[member.name]:04X}u)\n"


def specialise(program: Program) -> str:
    """The whole program as one text."""
    types, objects, functions = _merged(program)
    members = [m for m in program.split_members if program.is_object(m.name) and m.name not in program.split.far]
    for function in functions:
        name = function.decl.name
        _drop_field_writes(program, name, function.body)
        function.body = _Rewriter(program, name, [m.name for m in members]).rewrite(function.body)
    for node in objects + functions:
        declaration = node.decl if isinstance(node, c_ast.FuncDef) else node
        if _is_function(declaration) and declaration.name in program.dropped:
            _strip_parameters(program, declaration.name, declaration)
    own = [_object(program.split, member) for member in members]
    far = "".join(_far_macro(program.split, member) for member in program.split_members)
    return far + c_generator.CGenerator().visit(c_ast.FileAST(types + own + objects + functions))

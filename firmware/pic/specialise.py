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

from propagation import Program
from pycparser import c_ast, c_generator
from units import UNKNOWN, Path, SpecialiseError, Split, is_function, walk


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

    for node in walk(body):
        if isinstance(node, c_ast.Compound) and node.block_items:
            node.block_items = [item for item in node.block_items if not is_dead(item)]


def _strip_parameters(program: Program, name: str, declaration: c_ast.Decl) -> None:
    arguments = declaration.type.args
    dropped = program.dropped[name]
    if arguments is not None and dropped:
        kept = [p for p, drop in zip(arguments.params, dropped, strict=True) if not drop]
        void = c_ast.Typename(None, [], None, c_ast.TypeDecl(None, [], None, c_ast.IdentifierType(["void"])))
        declaration.type.args = c_ast.ParamList(kept or [void])


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
        if is_function(declaration) and declaration.name in program.dropped:
            _strip_parameters(program, declaration.name, declaration)
    own = [_object(program.split, member) for member in members]
    far = "".join(_far_macro(program.split, member) for member in program.split_members)
    return far + c_generator.CGenerator().visit(c_ast.FileAST(types + own + objects + functions))

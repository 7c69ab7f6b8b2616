"""Makes mutants of a source file: copies of it with one small fault each. Pure; `mutation` runs tests against them.

A mutant replaces an operator or a comparison, removes a sign, negates a condition, changes a number, swaps True and
False, removes a statement, or returns None instead of a value. Not changed are docstrings, annotations, decorators,
error texts and log lines, which no test of behaviour sees, and the arguments `strict=` and `daemon=`.
"""

from __future__ import annotations

import ast
import copy
from collections.abc import Sequence
from dataclasses import dataclass

OPERATORS: dict[type[ast.AST], type[ast.AST]] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult,
    ast.Pow: ast.Mult,
    ast.LShift: ast.RShift,
    ast.RShift: ast.LShift,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
    ast.BitXor: ast.BitAnd,
    ast.And: ast.Or,
    ast.Or: ast.And,
}
"""Replacement of each operator."""

GUARDING_KEYWORDS = ("strict", "daemon")
LOG_METHODS = ("debug", "info", "warning", "error", "exception")


@dataclass(frozen=True)
class Mutant:
    """One fault: in `file` (relative to the repository), bytes `start` to `end` become `text`."""

    file: str
    line: int
    function: str
    was: str
    now: str
    start: int
    end: int
    text: str

    @property
    def identity(self) -> tuple[str, str, str, str]:
        """Identifies the mutant independently of line numbers."""
        return self.file, self.function, self.was, self.now

    def applied(self, source: bytes) -> bytes:
        """Returns the file with the fault."""
        return source[: self.start] + self.text.encode() + source[self.end :]

    def __str__(self) -> str:
        where = f" in {self.function}" if self.function else ""
        return f"{self.file}:{self.line}{where}: {self.was}  →  {self.now}"


def mutants_of(source: bytes, file: str) -> list[Mutant]:
    """Returns every mutant of a file, in the order of its lines; equal texts come once."""
    maker = _Maker(source, file)
    maker.visit(ast.parse(source))
    unique = {(mutant.start, mutant.end, mutant.text): mutant for mutant in maker.found}
    return sorted(unique.values(), key=lambda mutant: (mutant.start, mutant.end, mutant.text))


class _Maker(ast.NodeVisitor):
    def __init__(self, source: bytes, file: str) -> None:
        self._source = source
        self._file = file
        self._names: list[str] = []
        self._line_starts = [0]
        for line in source.splitlines(keepends=True):
            self._line_starts.append(self._line_starts[-1] + len(line))
        self.found: list[Mutant] = []

    # ---- what is looked into

    def visit_FunctionDef(self, node: ast.FunctionDef | ast.AsyncFunctionDef) -> None:
        self._names.append(node.name)
        defaults = [default for default in (*node.args.defaults, *node.args.kw_defaults) if default is not None]
        self._visit_all([*defaults, *node.body])
        self._names.pop()

    visit_AsyncFunctionDef = visit_FunctionDef

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        self._names.append(node.name)
        self._visit_all(node.body)
        self._names.pop()

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        if node.value is not None:
            self.visit(node.value)

    def visit_JoinedStr(self, node: ast.JoinedStr) -> None:
        """Skipped: messages are not behaviour."""

    def visit_keyword(self, node: ast.keyword) -> None:
        if node.arg not in GUARDING_KEYWORDS:
            self.visit(node.value)

    # ---- statements

    def visit_Expr(self, node: ast.Expr) -> None:
        if isinstance(node.value, ast.Call) and not _logs(node.value):
            self._removed(node)
            self.generic_visit(node)
        elif not isinstance(node.value, ast.Constant):
            self.generic_visit(node)

    def visit_Assign(self, node: ast.Assign) -> None:
        if any(isinstance(target, ast.Name) and target.id.startswith("__") for target in node.targets):
            return
        if all(isinstance(target, ast.Attribute | ast.Subscript) for target in node.targets):
            self._removed(node)
        self.visit(node.value)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        self._removed(node)
        if type(node.op) in OPERATORS:
            changed = copy.copy(node)
            changed.op = OPERATORS[type(node.op)]()  # type: ignore[assignment]
            self._replaced(node, ast.unparse(changed))
        self.visit(node.value)

    def visit_Raise(self, node: ast.Raise) -> None:
        self._removed(node)

    def visit_Return(self, node: ast.Return) -> None:
        if node.value is not None:
            if not isinstance(node.value, ast.Constant):
                self._replaced(node.value, "None")
            self.visit(node.value)

    def visit_If(self, node: ast.If) -> None:
        if ast.unparse(node.test) not in ("TYPE_CHECKING", "__name__ == '__main__'"):
            self._negated(node.test)
            self.generic_visit(node)

    def visit_While(self, node: ast.While) -> None:
        self._negated(node.test)
        self.generic_visit(node)

    def visit_Continue(self, node: ast.Continue) -> None:
        self._replaced(node, "break")

    def visit_Break(self, node: ast.Break) -> None:
        self._replaced(node, "continue")

    # ---- expressions

    def visit_IfExp(self, node: ast.IfExp) -> None:
        self._negated(node.test)
        self.generic_visit(node)

    def visit_Compare(self, node: ast.Compare) -> None:
        for index, operator in enumerate(node.ops):
            changed = copy.copy(node)
            changed.ops = [*node.ops]
            changed.ops[index] = OPERATORS[type(operator)]()  # type: ignore[call-overload]
            self._replaced(node, f"({ast.unparse(changed)})")
        self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        self._other_operator(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:
        if not _is_union_of_types(node):
            self._other_operator(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        self._replaced(node, f"({ast.unparse(node.operand)})")
        self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> None:
        if isinstance(node.func, ast.Name) and node.func.id in ("isinstance", "issubclass"):
            self.visit(node.args[0])
        elif not _logs(node):
            self.generic_visit(node)

    def visit_Constant(self, node: ast.Constant) -> None:
        value = node.value
        if isinstance(value, bool):
            self._replaced(node, str(not value))
        elif isinstance(value, int):
            self._replaced(node, str(value + 1))
        elif isinstance(value, float):
            self._replaced(node, repr(2.0 * value if value else 1.0))

    # ---- how a mutant is recorded

    def _visit_all(self, nodes: Sequence[ast.AST]) -> None:
        for node in nodes:
            self.visit(node)

    def _negated(self, test: ast.expr) -> None:
        """Negates a condition; a comparison or a `not` is negated by its own mutant."""
        if not isinstance(test, ast.Compare | ast.UnaryOp):
            self._replaced(test, f"(not ({ast.unparse(test)}))")

    def _other_operator(self, node: ast.BinOp | ast.BoolOp) -> None:
        if type(node.op) in OPERATORS:
            changed = copy.copy(node)
            changed.op = OPERATORS[type(node.op)]()  # type: ignore[assignment]
            self._replaced(node, f"({ast.unparse(changed)})")
        self.generic_visit(node)

    def _removed(self, node: ast.stmt) -> None:
        self._replaced(node, "pass")

    def _replaced(self, node: ast.stmt | ast.expr, text: str) -> None:
        if node.end_lineno is None or node.end_col_offset is None:
            return
        start = self._line_starts[node.lineno - 1] + node.col_offset
        end = self._line_starts[node.end_lineno - 1] + node.end_col_offset
        was = ast.unparse(node)
        now = text.removeprefix("(").removesuffix(")") if text.startswith("(") else text
        self.found.append(Mutant(self._file, node.lineno, ".".join(self._names), was, now, start, end, text))


def _logs(call: ast.Call) -> bool:
    function = call.func
    return (
        isinstance(function, ast.Attribute)
        and function.attr in LOG_METHODS
        and isinstance(function.value, ast.Name)
        and function.value.id.lower().lstrip("_") in ("log", "logger", "logging")
    )


def _is_union_of_types(node: ast.BinOp) -> bool:
    if not isinstance(node.op, ast.BitOr):
        return False
    return any(_is_type(side) for side in (node.left, node.right))


def _is_type(node: ast.expr) -> bool:
    match node:
        case ast.Constant(value=None):
            return True
        case ast.Name(id=name) | ast.Attribute(attr=name) | ast.Subscript(value=ast.Name(id=name)):
            return name in ("int", "float", "str", "bool", "bytes") or (name[:1].isupper() and not name.isupper())
        case ast.BinOp():
            return _is_union_of_types(node)
    return False

"""The catalogue of faults: where each kind fits into a syntax tree, and what it writes there."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import tree_sitter_cpp
import tree_sitter_javascript
import tree_sitter_python
from tree_sitter import Language, Node, Parser

LANGUAGES = {".py": tree_sitter_python, ".js": tree_sitter_javascript, ".cpp": tree_sitter_cpp, ".h": tree_sitter_cpp}
FUNCTIONS = {
    "function_definition",
    "function_declaration",
    "method_definition",
    "arrow_function",
    "function_expression",
}
SKIPPED = {
    "type",
    "string",
    "template_string",
    "comment",
    "decorator",
    "import_statement",
    "assert_statement",
    "lambda",
}
BINARY = {"binary_operator", "binary_expression"}
COMPARISON = {"comparison_operator", "binary_expression"}
SIGNS = {"+": "-", "-": "+", "*": "/", "/": "*", "+=": "-=", "-=": "+="}
BOUNDS = {"<": "<=", "<=": "<", ">": ">=", ">=": ">"}
NEGATIONS = {"<": ">=", ">": "<=", "<=": ">", ">=": "<", "==": "!=", "!=": "==", "===": "!==", "!==": "==="}
ASSIGNMENTS = {"assignment", "assignment_expression", "augmented_assignment", "augmented_assignment_expression"}
LEAVES = {"raise_statement", "throw_statement", "return_statement"}
SMALL = {"0", "1", "2", "3"}
TERMS = {b"+", b"-", b"and", b"or", b"&&", b"||", b"&", b"|"}

Edit = tuple[int, int, str]  # first byte, byte after the last, what is written there


@dataclass(frozen=True)
class Mutant:
    """A fault: in the bytes `begin` to `end` of a file, `text` is written. context: the line."""

    path: Path
    kind: str
    line: int
    context: str
    begin: int
    end: int
    old: str
    text: str

    def apply(self, source: str) -> str:
        data = source.encode()
        return (data[: self.begin] + self.text.encode() + data[self.end :]).decode()

    def describe(self) -> str:
        old, new = (" ".join(text.split())[:80] for text in (self.old, self.text))
        return f"{self.path}:{self.line}: {self.kind}: {old} -> {new}    in: {self.context}"


def list_mutants(root: Path, paths: list[Path]) -> list[Mutant]:
    """Every fault of the catalogue that fits into the functions of some files."""
    found = []
    for path in paths:
        data = (root / path).read_bytes()
        tree = Parser(_load_language(path.suffix)).parse(data)
        for node in _walk(tree.root_node, inside=False):
            for kind, make in KINDS.items():
                for begin, end, text in make(node):
                    old, line = data[begin:end].decode(), data.count(b"\n", 0, begin) + 1
                    context = data.splitlines()[line - 1].decode().strip()
                    found.append(Mutant(path, kind, line, context, begin, end, old, text))
    return found


@cache
def _load_language(suffix: str) -> Language:
    return Language(LANGUAGES[suffix].language())


def _walk(node: Node, inside: bool) -> Iterator[Node]:
    """Nodes of functions' bodies, without what holds no behaviour."""
    if node.type in SKIPPED or _logs(node):
        return
    if inside:
        yield node
    inside = inside or node.type in FUNCTIONS
    for child in node.children:
        if inside and child.type in ("parameters", "formal_parameters", "parameter_list"):
            continue
        yield from _walk(child, inside)


def _logs(node: Node) -> bool:
    """Whether a node only logs or prints."""
    if node.type not in ("call", "call_expression"):
        return False
    name = node.children[0].text.decode()
    return name.startswith(("log.", "logger.", "logging.", "warnings.", "console.")) or name == "print"


def _operator(node: Node, table: dict[str, str]) -> Iterator[Edit]:
    for child in node.children:
        if not child.is_named and (text := table.get(child.text.decode())):
            yield child.start_byte, child.end_byte, text


def flip_sign(node: Node) -> Iterator[Edit]:
    if node.type in BINARY | {"augmented_assignment", "augmented_assignment_expression"}:
        yield from _operator(node, SIGNS)


def flip_comparison(node: Node) -> Iterator[Edit]:
    if node.type in COMPARISON:
        yield from _operator(node, NEGATIONS)


def miss_by_one(node: Node) -> Iterator[Edit]:
    """A bound that takes one more or one less, or a small integer one larger."""
    if node.type in COMPARISON:
        yield from _operator(node, BOUNDS)
    if node.type in ("integer", "number", "number_literal") and node.text.decode() in SMALL:
        yield node.start_byte, node.end_byte, str(int(node.text) + 1)


def swap_axes(node: Node) -> Iterator[Edit]:
    """An axis for another one, or the first two arguments of a call for each other."""
    if node.type == "keyword_argument" and node.children[0].text == b"axis" and node.children[-1].text in (b"0", b"1"):
        value = node.children[-1]
        yield value.start_byte, value.end_byte, "1" if value.text == b"0" else "0"
    if node.type in ("argument_list", "arguments"):
        first, second, *_ = [*node.named_children, None, None]
        plain = {
            "identifier",
            "attribute",
            "member_expression",
            "subscript",
            "subscript_expression",
            "field_expression",
        }
        if first and second and {first.type, second.type} <= plain and first.text != second.text:
            between = node.text[first.end_byte - node.start_byte : second.start_byte - node.start_byte].decode()
            yield first.start_byte, second.end_byte, second.text.decode() + between + first.text.decode()


def drop_term(node: Node) -> Iterator[Edit]:
    """One side of a sum, or of a conjunction."""
    left, right = node.child_by_field_name("left"), node.child_by_field_name("right")
    operator, texts = node.child_by_field_name("operator"), ("string", "template_string")
    if node.type not in BINARY | {"boolean_operator"} or not (left and right and operator):
        return
    if operator.text in TERMS and left.type not in texts and right.type not in texts:
        yield node.start_byte, node.end_byte, left.text.decode()


def drop_check(node: Node) -> Iterator[Edit]:
    """An `if` whose body only leaves (an error, an early return) never holds."""
    if node.type != "if_statement" or node.child_by_field_name("alternative"):
        return
    condition, body = node.child_by_field_name("condition"), node.child_by_field_name("consequence")
    statements = [body] if body.type in LEAVES else body.named_children
    if len(statements) == 1 and statements[0].type in LEAVES:
        yield condition.start_byte, condition.end_byte, "False" if body.type == "block" else "(false)"


def keep_stale(node: Node) -> Iterator[Edit]:
    """A name, or a place in memory, that is set again keeps the value that it had."""
    statement = node.parent
    if node.type not in ASSIGNMENTS or not statement or statement.type != "expression_statement":
        return
    left = node.child_by_field_name("left")
    augmented = node.type.startswith("augmented") or any(c.text in (b"+=", b"-=", b"*=", b"/=") for c in node.children)
    if left and (augmented or left.type in ("subscript", "subscript_expression") or _is_set_before(node, left)):
        yield statement.start_byte, statement.end_byte, "pass" if statement.text[-1:] != b";" else ";"


def _is_set_before(node: Node, left: Node) -> bool:
    """Whether a function assigns to a name before an assignment to it."""
    function = node
    while function and function.type not in FUNCTIONS:
        function = function.parent
    if not function or left.type != "identifier":
        return False
    stack = [function]
    while stack:
        each = stack.pop()
        target = each.child_by_field_name("left") or each.child_by_field_name("name")
        if target and target.text == left.text and each.start_byte < node.start_byte:
            return True
        stack += each.children
    return False


KINDS: dict[str, Callable[[Node], Iterator[Edit]]] = {
    "flip a sign": flip_sign,
    "flip a comparison": flip_comparison,
    "off by one": miss_by_one,
    "swap axes": swap_axes,
    "drop a term": drop_term,
    "drop a check": drop_check,
    "keep a stale value": keep_stale,
}

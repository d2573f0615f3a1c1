"""Programs of one shape each, of any depth: chains, nested statements and expressions, and odd encodings."""

from __future__ import annotations

from collections.abc import Callable, Mapping

CLOCK = "import time\na = time.time()\n"


def chain(operator: str) -> Callable[[int], str]:
    """Return what makes a chain of a binary operator, whose terms are clock readings and names."""
    return lambda depth: f"{CLOCK}x = a {f' {operator} a' * depth}\n"


def nested(begin: str, end: str, inside: str = "a") -> Callable[[int], str]:
    """Return what puts an expression into itself."""
    return lambda depth: f"{CLOCK}x = {begin * depth}{inside}{end * depth}\n"


def repeated(begin: str, part: str) -> Callable[[int], str]:
    """Return what repeats a text behind another."""
    return lambda depth: f"{CLOCK}{begin}{part * depth}\n"


def indented(opening: str, closing: str = "", *, most: int = 95) -> Callable[[int], str]:
    """Return what puts a statement into itself, as far as Python takes it."""

    def made(depth: int) -> str:
        levels = min(depth, most)
        lines = [" " * level + opening for level in range(levels)] + [" " * levels + "pass"]
        if closing:
            lines += [line for level in reversed(range(levels)) for line in (" " * level + closing, f"{' ' * level} a")]
        return CLOCK + "\n".join(lines) + "\n"

    return made


BINARY = ("+", "-", "*", "/", "//", "%", "**", "@", "&", "|", "^", "<<", ">>", "and", "or")
COMPARED = ("<", "==", "!=", "in", "is not")
#: Shape -> what makes it of a depth.
SHAPES: Mapping[str, Callable[[int], str]] = {
    **{f"chain of {operator}": chain(operator) for operator in BINARY},
    **{f"comparison by {operator}": chain(operator) for operator in COMPARED},
    "attributes": repeated("x = a", ".b"),
    "calls": repeated("x = a", "()"),
    "attributes and calls": repeated("x = a", ".b()"),
    "formatted attributes": repeated("x = '{0", ".real"),
    "open fields of formats": repeated("x = '", "{0.a["),
    "subscripts": repeated("x = a", "[0]"),
    "assignments": repeated("", "a = "),
    "assignments of a union": lambda depth: f"{'s = ' * depth}{'|'.join(['{1}'] * depth)}\nfor i in s: pass\n",
    "unions of sets": lambda depth: f"for x in {'|'.join(['{1}'] * depth)}: pass\n",
    "calls in calls": nested("str(", ")"),
    "arguments": nested("f(1, x=", ")"),
    "brackets": nested("(", ")"),
    "lists": nested("[", "]"),
    "dictionaries": nested("{1: ", "}"),
    "dictionaries that are spread": nested("{**", "}", "{}"),
    "sets": nested("{", "}"),
    "conditions": nested("a if a else ", ""),
    "lambdas": nested("lambda: ", ""),
    "defaults of lambdas": nested("lambda b=", ": 0", "a"),
    "named values": nested("(b := ", ")"),
    "named values and operators": nested("(b := a % ", ")"),
    "comprehensions": nested("[b for b in ", "]"),
    "conditions of comprehensions": lambda depth: f"x = [a for a in b{' if a' * depth}]\n",
    "loops of a comprehension": lambda depth: f"x = [a{' for a in b' * depth}]\n",
    "signs": nested("-", ""),
    "inversions": nested("~", ""),
    "negations": nested("not ", ""),
    "texts with fields": nested("f'{", "}'"),
    "texts with width": lambda depth: f"{CLOCK}x = f'" + "{a:{a}}" * depth + "'\n",
    "texts behind each other": repeated("x = ", "'b' "),
    "texts in a sum": repeated("x = 'b'", " + 'b'"),
    "awaited": lambda depth: f"async def f():\n    {'await ' * depth}a\n",
    "awaited calls": lambda depth: f"async def f():\n    x = {'await b(' * depth}a{')' * depth}\n",
    "yielded": lambda depth: f"def f():\n    x = {'(yield ' * depth}a{')' * depth}\n",
    "starred": nested("[*", "]"),
    "slices": nested("a[", ":]"),
    "decorators": lambda depth: "@a.b(a)\n" * depth + "def f(): pass\n",
    "long elif": lambda depth: "if a: pass\n" + "elif a - b: pass\n" * depth,
    "long elif that starts": lambda depth: "if a: pass\n" + "elif a: main()\n" * depth,
    "if": indented("if a:"),
    "for": indented("for i in a:", most=19),
    "while": indented("while a - time.time():", most=19),
    "with": indented("with a as b:", most=19),
    "finally": indented("try:", "finally:", most=19),
    "except": indented("try:", "except A:", most=19),
    "functions": indented("def f(a=time.time()):"),
    "classes": indented("class A(B):"),
    "patterns": lambda depth: f"match a:\n    case {'[' * depth}b{']' * depth}: pass\n",
    "patterns of classes": lambda depth: f"match a:\n    case {'A(b=' * depth}b{')' * depth}: pass\n",
    "alternatives": lambda depth: f"match a:\n    case {' | '.join(map(str, range(depth + 1)))}: pass\n",
    "annotations": nested("0\ny: A[", "] = 0", "B"),
    "imports": lambda depth: f"import {'.'.join(['a'] * (depth + 1))}\n",
    "names of imports": lambda depth: f"from a import {', '.join(f'b{n}' for n in range(depth + 1))}\n",
    "lines": repeated("", "a = time.time() - a\n"),
    "loops over texts": lambda depth: "".join(f"for v{n} in ('b',):\n    getattr(a, v{n})\n" for n in range(depth)),
    "a large number": lambda depth: f"x = 0x{'f' * depth}\n",
    "an open bracket": lambda depth: f"x = {'(' * depth}\n",
    "an open dictionary": lambda depth: f"x = {'{1: ' * depth}\n",
    "an open text": lambda depth: f"x = f'{'{' * depth}\n",
    "tabs": lambda depth: "".join(f"{chr(9) * n}if a:\n" for n in range(min(depth, 300))),
    "line continuations": lambda depth: f"x = a{chr(92)}\n" * depth,
    "null bytes": lambda depth: "\0" * depth,
}
#: Depths: ordinary, as deep as is examined, beyond it, beyond the stack of Python, and as large as files may be.
DEPTHS = (20, 95, 180, 400, 3_000, 20_000)
#: Encodings that a file declares, of Python, of other systems, and of nobody.
ENCODINGS = (
    *("utf-8", "utf-8-unix", "latin-1", "latin-1-dos", "iso-8859-15", "cp1252", "windows-1252", "gbk", "koi8-r"),
    *(
        "utf-7",
        "utf-16",
        "utf-32",
        "punycode",
        "idna",
        "rot13",
        "hex",
        "bz2",
        "zlib",
        "base64",
        "uu",
        "quopri",
        "undefined",
    ),
    *(
        "unicode_escape",
        "raw_unicode_escape",
        "mbcs",
        "hz",
        "iso2022_jp",
        "klingon",
        "a" * 300,
        "..",
        "os.path",
        "__init__",
    ),
)

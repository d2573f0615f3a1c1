"""Causes behind nodes that end by themselves or never come back."""

from __future__ import annotations

import ast

from grader.core.trace import Fault, FaultKind
from grader.judging.diagnosis.case import Case, Cause, Clue, frames
from grader.judging.diagnosis.wiring import made, reached
from grader.judging.source import Loop, Source, chain, covers, first_line, last_name

SPINS = ("spin", "spin_once", "spin_until_future_complete", "spin_once_until_future_complete")
_EXITS = ("exit", "quit", "_exit")


def _of_kind(case: Case, kind: FaultKind) -> tuple[Fault, Source] | None:
    return case.faulty if case.fault is not None and case.fault.kind is kind else None


def _events_executor(case: Case) -> Clue | None:
    for source in [case.source] if case.source is not None else []:
        used = next((n for n in source.all(ast.Call) if last_name(n.func) == "EventsExecutor"), None)
        stuck = case.fault is None or case.fault.kind is FaultKind.HUNG
        if used is not None and stuck and (made(source, "timer") or case.fault is not None):
            hint = "EventsExecutor never calls timers in this release of rclpy: use rclpy.spin(node)"
            return Clue(hint, source.place(used))
    return None


def _endless_loop(case: Case) -> Clue | None:
    found = _of_kind(case, FaultKind.HUNG)
    if found is None:
        return None
    fault, source = found
    loops = [n for n in source.loops() if covers(n, fault.line)]
    where = frames(fault)
    if not loops or not where:
        return None
    loop, name = loops[-1], where[-1][1]
    head = f"'{head_of(source, loop)}'"
    if name == "__init__":
        hint = f"the loop {head} keeps the constructor from returning, so nothing else can happen"
    elif name in _callbacks(source):
        hint = f"the loop {head} keeps {name} from returning: a callback must return at once"
    else:
        hint = f"the loop {head} neither waits nor spins: let a timer call the code instead"
    return Clue(hint, source.place(loop))


def head_of(source: Source, loop: Loop) -> str:
    """Return the first line of a loop without its colon."""
    if isinstance(loop, ast.While):
        return f"while {source.code(loop.test, 40)}"
    return f"for {source.code(loop.target, 20)} in {source.code(loop.iter, 40)}"


def _callbacks(source: Source) -> set[str]:
    return {last_name(m.callback) for kind in ("timer", "subscription") for m in made(source, kind)}


def _empty_file(case: Case) -> Clue | None:
    found = _of_kind(case, FaultKind.EXITED)
    if found is None or found[1].nodes or any(row.strip() for row in found[1].lines[:2000]):
        return None
    return Clue("the file is empty: hand in the one that holds your node")


def _left_by_arguments(case: Case) -> Clue | None:
    found = _of_kind(case, FaultKind.EXITED)
    if found is None or found[0].exit_code != 2:
        return None
    _, source = found
    for call in source.calls("add_argument"):
        first = call.args[0] if call.args else None
        keywords = {k.arg: k.value for k in call.keywords}
        positional = isinstance(first, ast.Constant) and not str(first.value).startswith("-")
        required = isinstance(keywords.get("required"), ast.Constant) and "default" not in keywords
        if (positional and "nargs" not in keywords and "default" not in keywords) or required:
            hint = "the file is run without arguments: give this one a default, as an option such as '--speed'"
            return Clue(hint, source.place(call))
    return None


def _left_by_exit(case: Case) -> Clue | None:
    found = _of_kind(case, FaultKind.EXITED)
    if found is None:
        return None
    fault, source = found
    exits: list[ast.AST] = [c for c in source.calls(*_EXITS) if chain(c.func) in (*_EXITS, "sys.exit", "os._exit")]
    exits += [r for r in source.all(ast.Raise) if last_name(_raised(r)) == "SystemExit"]
    if len(exits) != 1 or _at_the_end(source, exits[0]):
        return None
    leaving = exits[0]
    test = _argument_test(source, leaving)
    if test:
        hint = f"the file is run without arguments, so '{test}' is true: give the values defaults"
        return Clue(hint, source.place(leaving))
    if str(fault.exit_code) != _exit_code(leaving):
        return None
    hint = f"{source.code(leaving, 40)} ends the program: the node must run until it is stopped"
    return Clue(hint, source.place(leaving))


def _argument_test(source: Source, node: ast.AST) -> str:
    """Return the condition on the command line under which a node stands; empty if there is none."""
    tests = (source.code(n.test, 40) for n in source.around(node) if isinstance(n, ast.If))
    return next((t for t in tests if "argv" in t), "")


def _raised(node: ast.Raise) -> ast.AST | None:
    return node.exc.func if isinstance(node.exc, ast.Call) else node.exc


def _exit_code(node: ast.AST) -> str:
    call = node.exc if isinstance(node, ast.Raise) else node
    if not isinstance(call, ast.Call) or not call.args:
        return "0"
    first = call.args[0]
    return str(first.value) if isinstance(first, ast.Constant) else ""


def _at_the_end(source: Source, node: ast.AST) -> bool:
    """Return whether an exit is the way out after main(), or the answer to Ctrl-C."""
    if any(isinstance(n, ast.ExceptHandler) for n in source.around(node)):
        return True
    return source.function_of(node) is None and not _argument_test(source, node)


def _shut_down_in_callback(case: Case) -> Clue | None:
    found = _of_kind(case, FaultKind.EXITED)
    if found is None:
        return None
    _, source = found
    for kind in ("timer", "subscription"):
        for item in made(source, kind):
            for node in reached(source, source.functions(last_name(item.callback))):
                if isinstance(node, ast.Call) and chain(node.func) in ("rclpy.shutdown", "rclpy.try_shutdown"):
                    hint = f"{source.code(node)} in a callback ends the node: it must run until it is stopped"
                    return Clue(hint, source.place(node))
    return None


def _no_spin(case: Case) -> Clue | None:
    """The node is made, and the program ends."""
    found = _of_kind(case, FaultKind.EXITED)
    if found is None or found[0].exit_code != 0:
        return None
    _, source = found
    node = node_made(source)
    if node is None or spins(source):
        return None
    loops = [n for n in source.loops() if _publishes(source, n)]
    if loops:
        return _bounded_loop(source, loops)
    name = variable_of(source, node)
    hint = f"{source.code(node)} makes the node, then the program ends: call rclpy.spin({name}) after it"
    return Clue(hint, source.place(node))


def _bounded_loop(source: Source, loops: list[Loop]) -> Clue | None:
    loop = loops[-1]
    if isinstance(loop, ast.While) and not isinstance(loop.test, (ast.Compare, ast.BoolOp)):
        return None
    hint = f"the loop '{head_of(source, loop)}' comes to an end, and the program with it"
    return Clue(f"{hint}: go on until the node is stopped", source.place(loop))


def _publishes(source: Source, loop: ast.AST) -> bool:
    return any(isinstance(n, ast.Call) and last_name(n.func) == "publish" for n in reached(source, [loop]))


def _spins_once(case: Case) -> Clue | None:
    found = _of_kind(case, FaultKind.EXITED)
    if found is None or found[0].exit_code != 0:
        return None
    _, source = found
    named = spins(source)
    if any(last_name(n) == "spin" for n in named):
        return None
    once = list(source.calls("spin_once"))
    loops = [n for c in once for n in source.around(c) if isinstance(n, (ast.While, ast.For))]
    if len(once) == 1 and not loops:
        hint = f"{source.code(once[0])} handles one event and returns: use spin to go on until the node is stopped"
        return Clue(hint, source.place(once[0]))
    if len(loops) == 1:
        return _bounded_loop(source, loops)
    return None


def _gave_up(case: Case) -> Clue | None:
    """A return that leaves main before the node is spun."""
    found = _of_kind(case, FaultKind.EXITED)
    last = list(found[1].calls("spin"))[-1:] if found is not None else []
    if found is None or not last or found[0].exit_code != 0:
        return None
    source = found[1]
    leaving = [r for r in source.all(ast.Return) if source.function_of(r) is source.function_of(last[0])]
    early = [r for r in leaving if first_line(r) < first_line(last[0])]
    test = next((n for n in source.around(early[0]) if isinstance(n, ast.If)), None) if len(early) == 1 else None
    if test is None:
        return None
    hint = f"the return under 'if {source.code(test.test, 40)}' ends the program before {source.code(last[0], 40)}"
    return Clue(f"{hint}: keep waiting instead", source.place(early[0]))


def spins(source: Source) -> list[ast.AST]:
    """Return the places that name a function that spins, called or handed to a thread."""
    return [n for n in source.names() if last_name(n) in SPINS]


def node_made(source: Source) -> ast.Call | None:
    """Return the call that makes the node."""
    classes = {c.name for c in source.all(ast.ClassDef) if any(last_name(b) == "Node" for b in c.bases)}
    calls = [c for c in source.all(ast.Call) if last_name(c.func) in {*classes, "create_node", "Node"}]
    return next((c for c in calls if not isinstance(source.parents.get(c), ast.ClassDef)), None)


def variable_of(source: Source, call: ast.AST) -> str:
    """Return the name that a new node is given; `node` if it is given none."""
    statement = source.parents.get(call)
    named = isinstance(statement, ast.Assign) and len(statement.targets) == 1
    return chain(statement.targets[0]) or "node" if named and isinstance(statement, ast.Assign) else "node"


ENDINGS = (
    Cause("events_executor", _events_executor),
    Cause("endless_loop", _endless_loop),
    Cause("empty_file", _empty_file),
    Cause("left_by_arguments", _left_by_arguments),
    Cause("left_by_exit", _left_by_exit),
    Cause("shut_down_in_callback", _shut_down_in_callback),
    Cause("no_spin", _no_spin),
    Cause("spins_once", _spins_once),
    Cause("gave_up", _gave_up),
)

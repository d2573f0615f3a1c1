"""Causes of service calls that go astray: wrong names and types, waits without end, answers read too early."""

from __future__ import annotations

import ast

from grader.grading.judging.diagnosis.names import MESSAGE_FIELDS, SPINS
from grader.grading.judging.diagnosis.rules import Case, Clue, Crash, crash_rule, hint_rule
from grader.grading.judging.diagnosis.wiring import (
    callback_nodes,
    elsewhere_because,
    goes_to,
    has_threads,
    reached,
    roots,
    short,
    spin_for,
    spun_again,
    target_of,
    text_in_code,
    text_origin,
    unspun_wait,
)
from grader.grading.judging.facts import OtherEnd
from grader.grading.judging.source import (
    Function,
    Source,
    argument,
    chain,
    covers,
    first_line,
    last_name,
    literal_text,
    parameters,
)
from grader.grading.model.exercise import ProblemKind, roles_of, texts_under
from grader.grading.model.wording import quote
from grader.runtime.model.dataclass import dataclass

#: What gives a future.
_FUTURES = ("call_async", "send_goal_async", "get_result_async")
_ENDS = tuple(f"{name}()" for name in _FUTURES)
#: What waits for a future, or asks whether it is done.
_WAITS = {*SPINS, "wait", "done", "add_done_callback", "wait_for_future"}


def _ends(source: Source, kind: str) -> list[ast.Call]:
    """Return the calls that create servers (`service`) or clients (`client`)."""
    return list(source.calls(f"create_{kind}"))


@dataclass(frozen=True, slots=True)
class _End:
    """The end of a service that a check asks for: `kind` is `client` or `service`."""

    case: Case
    service: str
    kind: str


def _end(case: Case) -> _End | None:
    """Return the end of a service that the check declares; None if it is about none."""
    called = case.calls
    service = next(iter(called or case.serves), "")
    return _End(case, service, "client" if called else "service") if service else None


def _calling(case: Case) -> Case | None:
    """Return the case if it is about a client."""
    return case if case.calls else None


def _serving(case: Case) -> Case | None:
    """Return the case if it is about a server."""
    return case if case.serves else None


@hint_rule(problem=ProblemKind.OTHER_NAME, given=_end, priority=3010)
def _other_service(end: _End) -> Clue | None:
    """A server or client has another name."""
    other = end.case.found(OtherEnd)
    if other is None:
        return None
    found = other.name
    for source in end.case.sources.values():
        there = [(c, text_in_code(source, argument(c, 1, "srv_name"))) for c in _ends(source, end.kind)]
        fitting = [(c, name) for c, name in there if goes_to(name, found)] or (there if len(there) == 1 else [])
        if len(fitting) != 1:
            continue
        call, written = fitting[0]
        does = "asks" if end.kind == "client" else "offers"
        hint = f"{source.code(call)} {does} {quote(found, 60)}: the task asks for {end.service}"
        because = elsewhere_because(written, end.service)
        origin = call if because else text_origin(source, argument(call, 1, "srv_name"), call)
        return Clue(hint + because, source.place(origin))
    return None


@hint_rule(problem=ProblemKind.KEPT_APART, given=_end, priority=3015)
def _service_qos(end: _End) -> Clue | None:
    """A server or client has a QoS that the other end does not fit."""
    for source in end.case.sources.values():
        for call in _ends(source, end.kind):
            given = next((k for k in call.keywords if k.arg == "qos_profile"), None)
            if given is not None and goes_to(text_in_code(source, argument(call, 1, "srv_name")), end.service):
                other = "server" if end.kind == "client" else "client"
                hint = f"{source.code(given, 60)} does not match a {other} with the default QoS: remove it"
                return Clue(hint, source.place(given))
    return None


def _type_of(end: _End) -> str:
    """Return the type that a criterion of the exercise asks for; empty if none does."""
    for check in (end.case.check, *end.case.siblings):
        roles = roles_of(type(check))
        if end.service in texts_under(check, *roles.services) and (types := texts_under(check, roles.type)):
            return types[0]
    return ""


@hint_rule(given=_end, priority=3020)
def _other_service_type(end: _End) -> Clue | None:
    """A server or client has another type."""
    wanted, types = _type_of(end), {e.type for e in end.case.trace.service_ends(end.kind, end.service)}
    for source in end.case.sources.values():
        calls = [
            c for c in _ends(source, end.kind) if goes_to(text_in_code(source, argument(c, 1, "srv_name")), end.service)
        ]
        if not wanted or not types or wanted in types or len(calls) != 1:
            continue
        module, _, name = wanted.rpartition("/")
        hint = f"{source.code(calls[0])} uses {short(next(iter(types)))}: the task asks for {name}, "
        return Clue(f"{hint}from {module.replace('/', '.')} import {name}", source.place(calls[0]))
    return None


@hint_rule(priority=3025)
def _waits_while_there(case: Case) -> Clue | None:
    """A loop goes on while the service is there, and ends while it is not."""
    for source in case.sources.values():
        for loop in source.all(ast.While):
            test = loop.test
            if isinstance(test, ast.Call) and last_name(test.func) in ("wait_for_service", "wait_for_server"):
                code = source.code(test, 60)
                hint = f"{code} is true once it is there, so this loop ends too early, and then never: write while not "
                return Clue(f"{hint}{code}", source.place(loop), key="waits_while_there")
    return None


@hint_rule(given=_calling, priority=3030)
def _synchronous_call(case: Case) -> Clue | None:
    """`client.call()` waits for an answer that only a spinning node takes."""
    source = case.source
    clients = {target_of(source, c) for c in _ends(source, "client")} - {""}
    calls = [c for c in source.calls("call") if isinstance(c.func, ast.Attribute) and chain(c.func.value) in clients]
    names = {last_name(n) for n in source.names()}
    grouped = any(k.arg == "callback_group" for k in source.all(ast.keyword))
    for call in calls:
        code = source.code(call)
        if call in callback_nodes(source) and not (grouped and "MultiThreadedExecutor" in names):
            hint = f"{code} waits in a callback for a response that can only arrive after the callback returns"
            return Clue(f"{hint}: use call_async and add_done_callback", source.place(call), key="waits_in_callback")
        if not has_threads(source):
            hint = f"{code} waits forever: nothing spins the node meanwhile; use call_async, "
            return Clue(f"{hint}then {spin_for(source, call)}", source.place(call), key="unspun")
    return None


@hint_rule(given=_calling, priority=3040)
def _spins_in_callback(case: Case) -> Clue | None:
    """A callback spins the node that is spinning already."""
    source = case.source
    call = spun_again(source, callback_nodes(source))
    if call is None:
        return None
    hint = (
        f"{source.code(call)} runs in a callback, while the node is already spinning: take the response in a function"
    )
    return Clue(f"{hint} given to future.add_done_callback", source.place(call), key="waits_in_callback")


@hint_rule(fault=None, given=_calling, priority=3050)
def _future_never_done(case: Case) -> Clue | None:
    """A loop asks whether a future is done, and nothing spins the node meanwhile."""
    source = case.source
    found = None if has_threads(source) else unspun_wait(source)
    if found is None:
        return None
    loop, future = found
    hint = f"'while {source.code(loop.test, 40)}' never ends: a response is taken only while the node spins; "
    advice = _waiting_in(source, loop, future) or f"use {spin_for(source, loop, future)}"
    return Clue(f"{hint}{advice}", source.place(loop))


@hint_rule(given=_calling, priority=3060)
def _shared_callback_group(case: Case) -> Clue | None:
    """A callback awaits the response of a client in the same callback group, whose callbacks run one at a time."""
    source = case.source
    grouped = any(k.arg == "callback_group" for k in source.all(ast.keyword))
    clients = list(source.calls("create_client"))
    answers = source.calls("call_async")
    waits = [source.parents[call] for call in answers if isinstance(source.parents.get(call), ast.Await)]
    if grouped or not waits or len(clients) != 1:
        return None
    hint = f"{source.code(waits[0])} waits in a callback, and the client shares its callback group: "
    hint += "no response is taken meanwhile; create_client(..., callback_group=ReentrantCallbackGroup())"
    return Clue(hint, source.place(clients[0]), key="shared_group")


def _waiting_in(source: Source, place: ast.AST, future: str) -> str:
    """Return what to do about a future in a callback, which must not wait; empty elsewhere."""
    inside = place in source.called_back() or place in callback_nodes(source)
    return f"read the response in a function given to {future}.add_done_callback" if inside else ""


def _unawaited(source: Source) -> ast.AST | None:
    """Return where the result of a future is read in the function that made it, without any wait before."""
    for read_ in [*source.calls("result")]:
        function = source.function_of(read_)
        future = chain(read_.func.value) if isinstance(read_.func, ast.Attribute) else ""
        calls = [c for c in source.calls(*_FUTURES) if source.function_of(c) is function]
        made_here = [c for c in calls if target_of(source, c) == future or future.endswith(_ENDS)]
        if len(made_here) != 1 or first_line(made_here[0]) > first_line(read_):
            continue
        scope: ast.AST | None = function if function is not None else source.tree
        inside = reached(source, [scope]) if scope is not None else ()
        waits = [n for n in inside if isinstance(n, (ast.Name, ast.Attribute)) and last_name(n) in _WAITS]
        waits = [n for n in waits if not _is_for_another(source, n, future)]
        awaited = any(isinstance(n, ast.Await) for n in (ast.walk(scope) if scope is not None else ()))
        if not awaited and not any(first_line(w) <= first_line(read_) for w in waits):
            return read_
    return None


def _is_for_another(source: Source, name: ast.AST, future: str) -> bool:
    """Return whether `spin_until_future_complete` names another future."""
    call = source.parents.get(name)
    waited = argument(call, 1, "future") if isinstance(call, ast.Call) and call.func is name else None
    return last_name(name) == "spin_until_future_complete" and chain(waited) not in ("", future)


def _too_early(source: Source) -> Clue | None:
    found = _unawaited(source)
    if found is None:
        return None
    owner = chain(found.func.value) if isinstance(found, ast.Call) and isinstance(found.func, ast.Attribute) else ""
    future = owner if owner and "(" not in owner else "future"
    hint = f"{source.code(found)} is read before the response has arrived, so it is None: "
    waits = _waiting_in(source, found, future)
    hint += waits or f"first call {spin_for(source, found, future)}"
    return Clue(hint, source.place(found), key="result_too_early")


@hint_rule(given=_calling, priority=3070)
def _result_too_early(case: Case) -> Clue | None:
    """The result of a future is read at once."""
    return _too_early(case.source)


@crash_rule("'NoneType' object has no attribute|'NoneType' object is not subscriptable", priority=3080)
def _no_result_yet(crash: Crash) -> Clue | None:
    """The missing result of a future is used."""
    return _too_early(crash.source)


@crash_rule(
    r"'Future' object has no attribute '(\w+)'|'(?:function|method)' object has no attribute '(\w+)'", priority=3090
)
def _future_is_no_answer(crash: Crash) -> Clue | None:
    """The future of a call, or the method `result`, is used like the response."""
    source, name = crash.source, crash.found[1] or crash.found[2]
    if not any(source.calls("call_async")):
        return None
    for node in source.on_line(crash.line, ast.Attribute):
        if node.attr == name and last_name(node.value) == "result" and isinstance(node.value, ast.Attribute):
            code = source.code(node.value, 40)
            return Clue(f"result is a method: write {code}().{name}", source.place(node))
    if crash.found[1] is None:
        return None
    for call in source.calls("call_async"):
        waits = isinstance(source.parents.get(call), ast.Await)
        if isinstance(source.function_of(call), ast.AsyncFunctionDef) and not waits:
            code = source.code(call, 50)
            return Clue(f"call_async returns a future: write await {code} to get the response", source.place(call))
    hint = f"call_async returns a future, and {name} is in the response: call "
    used = next(source.on_line(crash.line, ast.Attribute), next(source.calls("call_async")))
    spin = spin_for(source, used)
    return Clue(f"{hint}{spin}, then future.result().{name}")


@crash_rule(
    r"'(\w+)_Request' object has no attribute '(\w+)'|'(\w+)_Response' object has no attribute '(\w+)'", priority=3100
)
def _request_is_response(crash: Crash) -> Clue | None:
    """The request of a service is taken for its response: swapped parameters, or a field of the other one."""
    source = crash.source
    for call in _ends(source, "service"):
        for function in roots(source, argument(call, 2, "callback")):
            if isinstance(function, Function) and covers(function, crash.line):
                names = parameters(function)
                own = names[:1] if source.is_method(function) else []
                pair = names[len(own) :]
                if len(pair) == 2 and pair[0].lower().startswith("res") and pair[1].lower().startswith("req"):
                    wanted = ", ".join([*own, pair[1], pair[0]])
                    hint = f"a service passes the request first: def {function.name}({wanted}):"
                    return Clue(hint, source.place(function))
    return _other_half(crash)


def _other_half(crash: Crash) -> Clue | None:
    """`request.success`: the field is one of the response, or the other way round."""
    source, (request, asked, response, answered) = crash.source, crash.found.groups()
    service, field, other = (request, asked, "Response") if request else (response, answered, "Request")
    if field not in MESSAGE_FIELDS.get(f"{service}_{other}", ()):
        return None
    function, hint = source.function_at(crash.line), f"{field} is a field of the {other.lower()}"
    for call in _ends(source, "service"):
        callbacks = roots(source, argument(call, 2, "callback"))
        names = parameters(function) if function is not None and function in callbacks else []
        if len(names) > 1:
            return Clue(f"{hint}: write {names[-1] if other == 'Response' else names[-2]}.{field}")
    waited = (source.parents.get(call) for call in source.calls("call_async"))
    values = [*source.calls("result", "call"), *(value for value in waited if isinstance(value, ast.Await))]
    answers = {target_of(source, value) for value in values if source.function_of(value) is function} - {""}
    if other == "Response" and len(answers) == 1:
        return Clue(f"{hint}: write {answers.pop()}.{field}")
    return Clue(hint)


@crash_rule(priority=3110)
def _future_before_node(crash: Crash) -> Clue | None:
    """The arguments of spin_until_future_complete are swapped."""
    source = crash.source
    for call in source.calls("spin_until_future_complete"):
        first = argument(call, 0, "node")
        futures = {target_of(source, c) for c in source.calls("call_async")} - {""}
        if covers(call, crash.line) and len(call.args) > 1 and chain(first) in futures:
            given = ", ".join([source.code(call.args[1], 30), source.code(call.args[0], 30)])
            return Clue(f"the node comes first, then the future: spin_until_future_complete({given})")
    return None


@crash_rule(priority=3120)
def _service_arguments(crash: Crash) -> Clue | None:
    """The arguments of create_client or create_service are swapped."""
    source = crash.source
    for kind in ("client", "service"):
        call = next((c for c in _ends(source, kind) if covers(c, crash.line) and len(c.args) > 1), None)
        if call is None:
            continue
        codes = [source.code(a, 40) for a in call.args]
        if literal_text(call.args[0]) is not None and literal_text(call.args[1]) is None:
            given = ", ".join([codes[1], codes[0], *codes[2:]])
            return Clue(f"the service type comes first, then the name: create_{kind}({given})")
        if (
            kind == "service"
            and len(codes) > 2
            and literal_text(call.args[1]) is None
            and literal_text(call.args[2]) is not None
        ):
            given = ", ".join([codes[0], codes[2], codes[1]])
            return Clue(f"the name comes second, then the callback: create_service({given})")
    return None


@hint_rule(problem=ProblemKind.WRONG_VALUE, given=_serving, priority=3130)
def _another_response(case: Case) -> Clue | None:
    """The callback fills in one response and returns another one."""
    source = case.source
    for call in _ends(source, "service"):
        for function in roots(source, argument(call, 2, "callback")):
            if not isinstance(function, Function) or len(parameters(function)) < 2:
                continue
            name = parameters(function)[-1]
            returns = [r for r in source.all(ast.Return) if source.function_of(r) is function and r.value is not None]
            filled = any(chain(n.value) == name and isinstance(n.ctx, ast.Store) for n in source.all(ast.Attribute))
            new = [r for r in returns if isinstance(r.value, ast.Call) and chain(r.value.func).endswith(".Response")]
            if filled and len(new) == len(returns) == 1 and not new[0].value.keywords:  # type: ignore[union-attr]
                hint = f"{source.code(new[0])} sends a new, empty response: write return {name}, which is filled in"
                return Clue(hint, source.place(new[0]))
    return None

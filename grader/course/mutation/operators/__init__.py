"""Makes the mutants of a program: every operator wherever it applies, without duplicates."""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Callable, Iterator, Mapping

from grader.course.mutation.operators import flow, values, words
from grader.course.mutation.operators.program import Candidate, Mutation, ParsedProgram, in_one_line

Operator = Callable[[ParsedProgram], Iterator[Mutation]]
#: Operator name -> operator; its docstring describes the mistake that it imitates.
OPERATORS: Mapping[str, Operator] = {
    operator.__name__: operator
    for operator in (
        *(words.topic_typo, words.topic_namespace, words.topic_private, words.topic_swapped),
        *(words.message_type, words.stamped_type, words.message_type_once),
        *(values.best_effort, values.transient_local),
        *(words.period, words.rate_as_period, words.sleeping_callback, words.busy_callback),
        *(values.counter_step, values.whole_number, values.constant, values.constant_less, values.sign),
        *(values.arithmetic, values.missing_operand, values.missing_conversion, values.cut_to_whole),
        *(values.wrong_field, values.wrong_part, values.swapped_arguments, values.swapped_values),
        *(values.missing_keyword, values.stale_field),
        *(flow.comparison, flow.swapped_branches, flow.constant_condition, flow.boolean, flow.loop_once),
        flow.unhandled,
        *(flow.missing_call, flow.missing_assignment, flow.missing_import, flow.missing_return),
        *(flow.missing_early_return, flow.missing_parameter),
        *(flow.callback_called, flow.timer_once, flow.spins_once),
        *(flow.repeated_call, flow.repeated_entity, flow.wrong_order),
        *(flow.exits_later, flow.crashes_on_third, flow.stops_later),
        *(flow.frozen_value, flow.first_message_only, flow.one_behind),
        *(words.print_instead, words.log_level, words.log_every_message),
        *(words.text, words.rounding, words.missing_value),
    )
}


def mutants_of(source: str, file: str, operators: Mapping[str, Operator] = OPERATORS) -> tuple[Candidate, ...]:
    """Return the mutants of a program, in the order of operators and lines.

    Mutants that are equivalent to the original or to an earlier mutant are skipped, and so are invalid programs.
    """
    program = ParsedProgram(source)
    seen = {meaning(source)}
    counts: Counter[str] = Counter()
    found = []
    for name, operator in operators.items():
        for change in operator(program):
            changed = program.changed(change.edits)
            means = meaning(changed)
            if means is None or means in seen:
                continue
            seen.add(means)
            detail = in_one_line(change.detail, 90)
            id_ = f"{file}:{program.line(change.at)}:{name}:{detail}"
            counts[id_] += 1
            again = f" #{counts[id_]}" if counts[id_] > 1 else ""
            found.append(Candidate(f"{id_}{again}", file, name, changed, detail))
    return tuple(found)


def meaning(source: str) -> str | None:
    """Return a form that is equal for sources that differ only in comments and layout; None for invalid Python."""
    try:
        tree = ast.parse(source)
        compile(tree, "mutant", "exec")
    except (SyntaxError, ValueError):
        return None
    return ast.dump(tree)

"""Makes the mutants of a program: every operator wherever it applies, without duplicates."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from grader.mutation.operators import flow, values, words
from grader.mutation.operators.program import Mutation, Program, short

Operator = Callable[[Program], Iterator[Mutation]]
#: Operator name -> operator; its docstring describes the mistake that it imitates.
OPERATORS: Mapping[str, Operator] = {
    operator.__name__: operator
    for operator in (
        words.topic_typo,
        words.topic_namespace,
        words.topic_private,
        words.topic_swapped,
        words.message_type,
        words.stamped_type,
        words.message_type_once,
        values.best_effort,
        values.transient_local,
        words.period,
        words.rate_as_period,
        words.sleeping_callback,
        words.busy_callback,
        values.counter_step,
        values.whole_number,
        values.constant,
        values.constant_less,
        values.sign,
        values.arithmetic,
        values.missing_operand,
        values.missing_conversion,
        values.cut_to_whole,
        values.wrong_field,
        values.wrong_part,
        values.swapped_arguments,
        values.swapped_values,
        values.missing_keyword,
        values.stale_field,
        flow.comparison,
        flow.swapped_branches,
        flow.constant_condition,
        flow.boolean,
        flow.loop_once,
        flow.unhandled,
        flow.missing_call,
        flow.missing_assignment,
        flow.missing_import,
        flow.missing_return,
        flow.missing_early_return,
        flow.missing_parameter,
        flow.callback_called,
        flow.timer_once,
        flow.spins_once,
        flow.repeated_call,
        flow.repeated_entity,
        flow.wrong_order,
        flow.exits_later,
        flow.crashes_on_third,
        flow.stops_later,
        flow.frozen_value,
        flow.first_message_only,
        flow.one_behind,
        words.print_instead,
        words.log_level,
        words.log_every_message,
        words.text,
        words.rounding,
        words.missing_value,
    )
}


@dataclass(frozen=True, slots=True)
class Mutant:
    """A program with one mistake.

    Attributes:
        line: Line of the original that was changed, from 1.
        operator: Key of `OPERATORS`.
        number: Distinguishes mutants with the same file, line, operator and detail, starting at 1.
    """

    file: str
    line: int
    operator: str
    detail: str
    source: str
    number: int = 1

    @property
    def id(self) -> str:
        """An id that stays the same as long as the reference solution does."""
        again = f" #{self.number}" if self.number > 1 else ""
        return f"{self.file}:{self.line}:{self.operator}:{self.detail}{again}"


def mutants_of(source: str, file: str, operators: Mapping[str, Operator] = OPERATORS) -> tuple[Mutant, ...]:
    """Return the mutants of a program, in the order of operators and lines.

    Mutants that are equivalent to the original or to an earlier mutant are skipped, and so are invalid programs.
    """
    program = Program(source)
    seen = {meaning(source)}
    counts: dict[str, int] = {}
    found = []
    for name, operator in operators.items():
        for change in operator(program):
            changed = program.changed(change.edits)
            means = meaning(changed)
            if means is None or means in seen:
                continue
            seen.add(means)
            mutant = Mutant(file, program.line(change.at), name, short(change.detail, 90), changed)
            counts[mutant.id] = counts.get(mutant.id, 0) + 1
            found.append(Mutant(file, mutant.line, name, mutant.detail, changed, counts[mutant.id]))
    return tuple(found)


def meaning(source: str) -> str | None:
    """Return a form that is equal for sources that differ only in comments and layout; None for invalid Python."""
    try:
        tree = ast.parse(source)
        compile(tree, "mutant", "exec")
    except (SyntaxError, ValueError):
        return None
    return ast.dump(tree)

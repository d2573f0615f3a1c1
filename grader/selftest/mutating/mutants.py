"""The mutants of a program: every operator at every place it fits, each distinct source once."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from grader.selftest.mutating import calls, endings, fields, logic, logs, naming, numbers, pacing, quality
from grader.selftest.mutating.program import Change, Program, short

Operator = Callable[[Program], Iterator[Change]]
#: Operator name -> what imitates the mistake; its docstring says which mistake that is.
OPERATORS: Mapping[str, Operator] = {
    operator.__name__: operator
    for operator in (
        naming.topic_typo,
        naming.topic_namespace,
        naming.topic_private,
        naming.topic_swapped,
        naming.message_type,
        naming.stamped_type,
        naming.message_type_once,
        quality.best_effort,
        quality.transient_local,
        pacing.period,
        pacing.rate_as_period,
        pacing.sleeping_callback,
        pacing.busy_callback,
        numbers.counter_step,
        numbers.whole_number,
        numbers.constant,
        numbers.constant_less,
        numbers.sign,
        numbers.arithmetic,
        numbers.missing_operand,
        numbers.missing_conversion,
        numbers.cut_to_whole,
        fields.wrong_field,
        fields.wrong_part,
        fields.swapped_arguments,
        fields.swapped_values,
        fields.missing_keyword,
        fields.stale_field,
        logic.comparison,
        logic.swapped_branches,
        logic.constant_condition,
        logic.boolean,
        logic.loop_once,
        logic.unhandled,
        calls.missing_call,
        calls.missing_assignment,
        calls.missing_import,
        calls.missing_return,
        calls.missing_early_return,
        calls.missing_parameter,
        calls.callback_called,
        calls.timer_once,
        calls.spins_once,
        calls.repeated_call,
        calls.repeated_entity,
        calls.wrong_order,
        endings.exits_later,
        endings.crashes_on_third,
        endings.stops_later,
        endings.frozen_value,
        endings.first_message_only,
        endings.one_behind,
        logs.print_instead,
        logs.log_level,
        logs.log_every_message,
        logs.text,
        logs.rounding,
        logs.missing_value,
    )
}


@dataclass(frozen=True, slots=True)
class Mutant:
    """A program with one mistake in it.

    Attributes:
        file: Name of the file.
        line: Line of the original that was changed, from 1.
        operator: Key of `OPERATORS`.
        detail: What was changed into what.
        source: The whole changed program.
        number: Counts mutants whose file, line, operator and detail are the same, from 1.
    """

    file: str
    line: int
    operator: str
    detail: str
    source: str
    number: int = 1

    @property
    def id(self) -> str:
        """A name that stays the same as long as the reference solution does."""
        again = f" #{self.number}" if self.number > 1 else ""
        return f"{self.file}:{self.line}:{self.operator}:{self.detail}{again}"


def mutants_of(source: str, file: str, operators: Mapping[str, Operator] = OPERATORS) -> tuple[Mutant, ...]:
    """Return the mutants of a program, in the order of operators and lines.

    A mutant that means the same as the original or as one before it is left out, and so is what is no Python any more.

    Args:
        source: The program.
        file: Its name, for the ids.
        operators: What makes them.
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
    """Return what two sources have in common that differ in comments and layout only; None for what is no Python."""
    try:
        tree = ast.parse(source)
        compile(tree, "mutant", "exec")
    except (SyntaxError, ValueError):
        return None
    return ast.dump(tree)

"""Correct variants of a program: the same behaviour written as other people write it; none may cost a point."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from grader.selftest.mutating import rewriting, styles
from grader.selftest.mutating.mutants import meaning
from grader.selftest.mutating.program import Program

#: Returns the source of a variant, or the same source where there is nothing to vary.
Rewriter = Callable[[Program], str]
#: Variant name -> what writes it; its docstring says how it differs.
VARIANTS: Mapping[str, Rewriter] = {
    rewriter.__name__: rewriter
    for rewriter in (
        rewriting.renamed_classes,
        rewriting.renamed_functions,
        rewriting.renamed_methods,
        rewriting.renamed_attributes,
        rewriting.renamed_variables,
        rewriting.renamed_nodes,
        rewriting.reordered_methods,
        rewriting.reordered_constants,
        styles.single_quotes,
        styles.windows_lines,
        styles.other_topic_form,
        styles.keyword_arguments,
        styles.percent_format,
        styles.format_method,
        styles.qos_object,
        styles.lambda_callbacks,
        styles.executor,
        styles.loop_in_thread,
        styles.without_guard,
    )
}


@dataclass(frozen=True, slots=True)
class Variant:
    """A correct program beside the reference solution.

    Attributes:
        file: Name of the file.
        name: Key of `VARIANTS`.
        source: The whole program.
    """

    file: str
    name: str
    source: str

    @property
    def id(self) -> str:
        """A name that stays the same as long as the reference solution does."""
        return f"{self.file}:{self.name}"


def variants_of(source: str, file: str, rewriters: Mapping[str, Rewriter] = VARIANTS) -> tuple[Variant, ...]:
    """Return the variants that differ from a program, in the order of the table.

    Args:
        source: The program.
        file: Its name, for the ids.
        rewriters: What makes them.
    """
    program = Program(source)
    written = ((name, rewriter(program)) for name, rewriter in rewriters.items())
    return tuple(Variant(file, name, text) for name, text in written if text != source and meaning(text) is not None)

"""The mark that counts and an instructor's decisions, put into a finished page; also the page of a refusal."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import field
from fractions import Fraction

from markupsafe import Markup, escape

from grader.grading.model.exercise import Outcome
from grader.grading.reporting import wording
from grader.grading.reporting.escape import shown
from grader.grading.reporting.html.assets import bundle, page_template
from grader.runtime.model.dataclass import dataclass

_PLACE = re.compile(r"<!--([\w/:-]+)-->.*?<!--/\1-->", re.DOTALL)
_TITLE = re.compile(r"<title>.*?</title>", re.DOTALL)


@dataclass(frozen=True, slots=True)
class ScoreShown:
    """The score at the top of a page."""

    score: Fraction
    max_score: Fraction
    outcomes: tuple[Outcome, ...]  # of each criterion, as graded
    final: bool = True  # whether every criterion was decided
    graded: Fraction | None = None  # the points as graded, where the score differs from them
    remark: str = ""  # a sentence below it; empty for none

    @property
    def percent(self) -> float:
        """Share of the maximum points, in percent, at most 100."""
        return round(min(100.0, float(100 * self.score / self.max_score)), 2) if self.max_score else 0.0

    @property
    def full(self) -> bool:
        """Whether the score is final and no point is missing."""
        return self.final and self.score >= self.max_score

    @property
    def points(self) -> str:
        """The points as text."""
        return wording.points(self.score)

    @property
    def of(self) -> str:
        """The maximum points as text."""
        return wording.points(self.max_score)

    @property
    def lines(self) -> list[str]:
        """What is said below the score."""
        said = [wording.summary_of(self.outcomes, final=self.final)]
        if self.graded is not None:
            raw = f"{wording.points(self.graded)} of {self.of} points"
            said = [f"As graded: {raw}, {wording.outcome_counts(self.outcomes)}."]
        return [*said, self.remark] if self.remark else said


@dataclass(frozen=True, slots=True)
class CriterionMark:
    """What counts for one criterion."""

    score: Fraction
    max_score: Fraction
    decision: str = ""  # what an instructor decided about its points, in a sentence; empty if nothing
    comment: str = ""  # an instructor's comment for the student; may be empty


@dataclass(frozen=True, slots=True)
class FinalMark:
    """What a class knows of a student's mark besides the report; all texts may be hostile."""

    student: str  # the student's name
    phrase: str = ""  # the mark that counts, as a phrase, for a page without a report; empty if there is none
    decisions: tuple[str, ...] = ()  # what an instructor decided about the whole, a sentence each
    score: ScoreShown | None = None  # the score that counts; None to keep that of the report
    exercises: Mapping[str, tuple[Fraction, Fraction]] = field(default_factory=dict)  # id -> points that count, maximum
    # `exercise/criterion` -> what counts for it
    criteria: Mapping[str, CriterionMark] = field(default_factory=dict)


def replaceable(name: str, content: str) -> Markup:
    """Return content of a page that `with_final_mark` may replace; the content is markup."""
    return Markup(f"<!--{name}-->{content}<!--/{name}-->")  # noqa: S704  the content is escaped where it is made


def score_place(score: ScoreShown) -> Markup:
    """Return the score at the top of a page."""
    return replaceable("score", page_template("score").render(score=score))


def points_place(exercise: str, score: Fraction, max_score: Fraction) -> Markup:
    """Return the points of an exercise."""
    return replaceable(f"points:{exercise}", _points(score, max_score))


def earned_place(criterion: str, mark: CriterionMark) -> Markup:
    """Return the points of a criterion, with a word if an instructor wrote something about it."""
    words = "decided" if mark.decision else "comment" if mark.comment else ""
    tag = f'<span class="decided">{words}</span> ' if words else ""
    return replaceable(f"earned:{criterion}", f"{tag}{_points(mark.score, mark.max_score)}")


def decision_place(criterion: str, mark: CriterionMark) -> Markup:
    """Return what an instructor wrote about a criterion, as rows of its list."""
    rows = (("Decision", mark.decision), ("Comment", mark.comment))
    made = "".join(
        f'<div class="decision"><dt>{name}</dt><dd>{escape(shown(text, limit=1_200))}</dd></div>'
        for name, text in rows
        if text
    )
    return replaceable(f"decision:{criterion}", made)


def _points(score: Fraction, max_score: Fraction) -> str:
    return f'{wording.points(score)} <span class="of">/ {wording.points(max_score)}</span>'


def with_final_mark(page: str, mark: FinalMark) -> str:
    """Return a page with this mark wherever points are shown, in place of any earlier one.

    The places are comments; a student cannot write one, because all other text of the page is escaped.
    """
    made: dict[str, str] = dict(_places(mark))
    page = _PLACE.sub(lambda found: made.get(found[1], found[0]), page)
    if mark.score is None:
        return page
    title = escape(f"{shown(mark.student, limit=wording.NAME_LIMIT)}: {mark.score.points} of {mark.score.of} points")
    return _TITLE.sub(lambda _: f"<title>{title}</title>", page, count=1)


def _places(mark: FinalMark) -> Iterator[tuple[str, str]]:
    yield "student", replaceable("student", str(escape(shown(mark.student, limit=wording.NAME_LIMIT))))
    yield "final-mark", replaceable("final-mark", page_template("final-mark").render(mark=mark))
    if mark.score is not None:
        yield "score", score_place(mark.score)
    for id_, (score, max_score) in mark.exercises.items():
        yield f"points:{id_}", points_place(id_, score, max_score)
    for id_, criterion in mark.criteria.items():
        yield f"earned:{id_}", earned_place(id_, criterion)
        yield f"decision:{id_}", decision_place(id_, criterion)


def render_refusal(mark: FinalMark, problem: str, hint: str) -> str:
    """Return the page of a student whose submission cannot be used, which makes no network requests."""
    style = Markup(bundle().style)  # noqa: S704  our own style sheet
    made = page_template("refusal").render(mark=mark, problem=problem, hint=hint, style=style)
    return with_final_mark(made, mark)

"""Reads the recordings that scenarios play: those of rubrics, or those that the user gives instead."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from grader.grading.model.exercise import Exercise, recordings_in
from grader.grading.rubrics.builtin import builtin_recording
from grader.runtime.compiled import COMPILED, compiled, state_of
from grader.runtime.model.errors import RecordingError
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.wording import listed, printable
from grader.runtime.recording.bag import BagMinimum, Define, read_bag, topics_in
from grader.runtime.shipped import PACKAGE, shipped
from grader.runtime.stimuli import RecordedStream, Recording

if TYPE_CHECKING:
    from grader.grading.app.request import GradeRequest

#: The recording of each stimulus that plays one.
Recordings = Mapping[RecordedStream, Recording]
#: A recording that replaces another one has to be as long as that one, or this long: the part that is played is drawn,
#: and a node that does something once a second has to be seen doing it.
ENOUGH = BagMinimum(messages=20, span_ns=5 * NS_PER_S)


def read_recordings(request: GradeRequest, exercises: Iterable[Exercise]) -> Recordings:
    """Read what the scenarios of some exercises play; raises RecordingError."""
    folders = dict.fromkeys(Path(one) for exercise in exercises for one in exercise.interfaces)
    streams = [stream for exercise in exercises for stream in recordings_in(exercise)]
    return recordings_of(streams, (*folders, *request.interfaces), request.bags)


def recordings_of(
    streams: Iterable[RecordedStream], interfaces: tuple[Path, ...], given: Sequence[tuple[str, Path]] = ()
) -> Recordings:
    """Read what some stimuli play, or what is given instead; raises RecordingError.

    The interfaces are folders of packages that are not installed.
    """
    define = _define(interfaces)
    return {stream: _recording(stream, given, define) for stream in dict.fromkeys(streams)}


def played_bags(given: Iterable[tuple[str, Path]], start_ns: int, duration_ns: int) -> tuple[RecordedStream, ...]:
    """Return stimuli that play recordings without a rubric; raises RecordingError for an unclear topic or type."""
    return tuple(RecordedStream(*_topic_in(name, path), str(path), start_ns, duration_ns) for name, path in given)


def _topic_in(name: str, path: Path) -> tuple[str, str]:
    """Return the topic to play a recording on, given by its name or type, and its type."""
    topics = topics_in(path)
    if name.startswith("/"):
        types = {topics[name]} if name in topics else set(topics.values())
        if len(types) == 1:
            return name, types.pop()
    else:
        named = [topic for topic, type_ in topics.items() if type_ == name]
        if len(named) == 1:
            return named[0], name
    known = listed(sorted(f"{topic} ({type_})" for topic, type_ in topics.items()), "and") if topics else "no topics"
    where = f"--recording {printable(name)}={printable(str(path), 500)}"
    raise RecordingError(
        f"{where}: expected one topic to play, found {printable(known, 500)}", "name one of its topics"
    )


def _recording(stream: RecordedStream, given: Sequence[tuple[str, Path]], define: Define) -> Recording:
    own = _own(stream, define)
    path = replacement(stream, given)
    if path is None:
        return own
    least = BagMinimum(min(ENOUGH.messages, len(own.messages)), min(ENOUGH.span_ns, own.span_ns))
    return read_bag(path, stream.topic, stream.type, least=least, define=define)


def replacement(stream: RecordedStream, given: Iterable[tuple[str, Path]]) -> Path | None:
    """Return the recording to play instead of a stimulus's own: the last one given for its topic, else for its type."""
    found = dict(given)
    return found.get(stream.topic) or found.get(stream.type)


def refuse_unplayed(given: Iterable[tuple[str, Path]], exercises: Sequence[Exercise]) -> None:
    """Raise RecordingError for a recording on a topic on which no exercise of the rubrics plays one."""
    played = {stream.topic for exercise in exercises for stream in recordings_in(exercise)}
    for topic, path in given:
        if topic.startswith("/") and topic not in played:
            where = f"--recording {printable(topic)}={printable(str(path), 500)}"
            found = f"recordings are played on {listed(sorted(played))}" if played else "no rubric plays a recording"
            raise RecordingError(f"{where}: expected a topic on which a rubric plays a recording, but {found}")


def read_given(request: GradeRequest, recordings: Recordings) -> tuple[Recording, ...]:
    """Return the recordings that are played, and those that were given and are played by no exercise that is graded."""
    used = {path for stream in recordings if (path := replacement(stream, request.bags)) is not None}
    others = [(name, path) for name, path in request.bags if path not in used and not name.startswith("/")]
    read = [read_bag(path, "", type_, define=_define(request.interfaces)) for type_, path in others]
    return (*recordings.values(), *read)


def _own(stream: RecordedStream, define: Define) -> Recording:
    """Return the recording of a rubric, which is kept in a compiled form if it ships with the grader."""
    path = Path(stream.bag) if stream.bag else builtin_recording()
    if path.is_relative_to(shipped("rubrics")):
        return shipped_recording(path, stream.topic, stream.type)
    return read_bag(path, stream.topic, stream.type, define=define)


@cache
def shipped_recording(path: Path, topic: str, type_: str, forms: Path = COMPILED) -> Recording:
    """Return a recording that ships with the grader, of which a folder keeps a compiled form."""
    code = (PACKAGE / name for name in ("runtime/recording/bag.py", "runtime/stimuli/recorded.py"))
    name = hashlib.sha256(f"{path.name} {topic} {type_}".encode()).hexdigest()[:8]
    files = path.iterdir() if path.is_dir() else [path]
    return compiled(f"recording-{name}", state_of([*files, *code]), lambda: read_bag(path, topic, type_), forms)


def _define(folders: tuple[Path, ...]) -> Define:
    """Return what looks up the definition of a type, installed or in some folders of interface packages."""

    def definition(type_: str) -> str | None:
        # Takes long, and is seldom needed.
        from grader.grading.app.interfaces import known_interfaces  # noqa: PLC0415

        known = known_interfaces(folders)
        found = known.definition(type_) if known is not None else None
        return None if found is None else found.text

    return definition


def recordings_digest(recordings: Iterable[Recording]) -> str:
    """Return `sha256:` over the topics, times and bytes of what is played, in whatever format; empty for nothing."""
    digests = sorted({recording_digest(recording) for recording in recordings})
    if len(digests) < 2:
        return "".join(digests)
    return f"sha256:{hashlib.sha256(''.join(digests).encode()).hexdigest()}"


def recording_digest(recording: Recording) -> str:
    """Return `sha256:` over the topic, times and bytes of a recording; independent of the storage format."""
    digest = hashlib.sha256(f"{recording.topic}\n".encode())
    for message in recording.messages:
        digest.update(f"{message.t_ns} {len(message.cdr)}\n".encode() + message.cdr)
    return f"sha256:{digest.hexdigest()}"

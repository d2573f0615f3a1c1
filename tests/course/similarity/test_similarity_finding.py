"""Which submissions are listed as similar: disguised copies, and not programs that were written independently."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import copies
import pytest
from copies import FILE, handed
from places import ROOT, TESTS
from sample_folders import folder_of
from tiers import each

from grader.course.similarity import finding
from grader.course.similarity.finding import (
    COMMON_LEAST,
    COMMON_MOST,
    LEAST_DIFFERENT,
    MAX_BYTES,
    find_similar,
    read_compared,
    read_templates,
)
from grader.course.similarity.library import ComparedTopic, Handed, Similar
from grader.runtime.model.errors import ClassError

#: Programs of people who do not know each other.
STRANGERS = ("odom_chinese", "odom_csv", "odom_distance", "odom_globals_spin_once", "odom_json", "odom_namedtuple",
             "odom_history_path", "odom_loop_with_deadline", "odom_watchdog", "odom_yaml_lines")  # fmt: skip


def strangers() -> list[Handed]:
    """Return a class in which everybody worked alone."""
    return [Handed(name, name, *read_compared(folder_of(f"correct/{name}"))) for name in STRANGERS]


def text_of(name: str) -> str:
    """Return the program of a stranger."""
    return (folder_of(f"correct/{name}") / FILE).read_text(encoding="utf-8")


def pairs(similar: Similar) -> list[tuple[str, str]]:
    """Return the names in each pair."""
    return [(pair.left.name, pair.right.name) for pair in similar.pairs]


def test_programs_written_independently_are_not_listed() -> None:
    """They solve the same exercise, with the same calls."""
    assert pairs(find_similar(strangers(), ())) == []


@pytest.mark.parametrize("disguise", copies.DISGUISES)
def test_disguised_copies_are_listed(disguise: str) -> None:
    """Other names, texts, comments and another order hide none of them, and nobody else is drawn in."""
    copied = STRANGERS[::4]
    made = [handed(f"z {name}", copies.DISGUISES[disguise](text_of(name), 7)) for name in copied]
    found = find_similar([*strangers(), *made], ())
    assert sorted(pairs(found)) == sorted((name, f"z {name}") for name in copied)
    assert found.same == ()


def test_the_order_of_the_class_changes_nothing() -> None:
    """The same pairs are found with the same shares."""
    group = [*strangers(), handed("z", copies.renamed(text_of("odom_csv"), 1))]
    there, back = find_similar(group, ()), find_similar(group[::-1], ())
    assert [set(pair) for pair in pairs(there)] == [set(pair) for pair in pairs(back)] == [{"odom_csv", "z"}]
    assert there.pairs[0].share == back.pairs[0].share


@pytest.mark.long
@pytest.mark.slow
def test_the_process_changes_nothing() -> None:
    """The library's digests differ from process to process; what is found does not."""
    program = (
        "import sys; sys.path[:0] = sys.argv[1:]\n"
        "import test_similarity_finding as t, copies\n"
        "from grader.course.similarity.pages import render_table\n"
        "copied = t.handed('z', copies.logged(t.text_of('odom_csv'), 1))\n"
        "print(render_table(t.find_similar([*t.strangers(), copied], ())))"
    )
    command = [sys.executable, "-c", program, str(Path(__file__).parent), str(TESTS / "support")]
    said = [
        subprocess.run(
            command, env={**os.environ, "PYTHONHASHSEED": seed}, check=True, capture_output=True, text=True
        ).stdout
        for seed in ("1", "2")
    ]
    assert said[0] == said[1]
    assert said[0].count("similar,") == 1


def test_code_that_was_handed_out_does_not_count() -> None:
    """Two students who filled in the same template are not alike; without the template they would be."""
    template = text_of("odom_yaml_lines")
    ada = handed("ada", template.replace("main()", "print(1)\n    main()"))
    bob = handed("bob", template + "\n# done\n")
    given = handed("", template).programs
    assert pairs(find_similar([ada, bob], ())) == [("ada", "bob")]
    assert pairs(find_similar([ada, bob], given)) == []


@pytest.mark.parametrize("encoding", ["punycode", "idna", "unicode_escape", "nothing"])
def test_only_encodings_that_take_linear_time_are_decoded(encoding: str) -> None:
    """Any other text is compared as UTF-8."""
    written = f"# coding: {encoding}\nname = 'ü-ß'\n"
    assert finding.decoded_text(written.encode()) == written
    assert finding.decoded_text("# coding: latin-1\nname = 'ü'\n".encode("latin-1")).endswith("name = 'ü'\n")


OBVIOUS = {
    "ada": "self.pub = self.create_publisher(Twist, '/cmd_vel', 10)|self.timer = self.create_timer(0.05, self.tick)||"
    "def tick(self):|    self.pub.publish(self.msg)|    self.get_logger().info('published')",
    "bob": "self.publisher_ = self.create_publisher(Twist, '/cmd_vel', 10)|self.timer = self.create_timer(0.05, "
    "self.callback)||def callback(self):|    self.publisher_.publish(self.msg)|    self.get_logger().info('sending')",
    "cleo": "self.p = self.create_publisher(Twist, 'cmd_vel', 10)|period = 0.05|self.timer = self.create_timer(period, "
    "self.send)||def send(self):|    self.p.publish(self.msg)|    self.get_logger().info(f'v = {self.msg.linear.x}')",
}


def test_who_fills_the_gaps_of_a_template_in_the_obvious_way_is_not_listed() -> None:
    """There is hardly another way, and two of three in a small class are no crowd whose code is taken out."""
    template = (ROOT / "student_template" / "velocity_publisher.py").read_text(encoding="utf-8")
    before, after = template[: template.index("        # TODO: create a pub")], template[template.index("def main") :]
    group = []
    for name, lines in OBVIOUS.items():
        filled = "\n".join(("    " if "def " in ln or ln[:1] == " " else "        ") + ln for ln in lines.split("|"))
        group.append(handed(name, f"{before}{filled}\n\n\n{after}"))
    compile(group[0].programs[0].text, "ada", "exec")
    assert pairs(find_similar(group, read_templates([ROOT / "student_template"]))) == []


def test_what_many_write_does_not_count() -> None:
    """In a small class, what more than a few have is what everybody writes; byte for byte the same is told anyway."""
    few = [handed(f"friend {k}", text_of("odom_csv")) for k in range(COMMON_LEAST)]
    assert len(find_similar([*strangers(), *few[1:]], ()).pairs) == COMMON_LEAST * (COMMON_LEAST - 1) / 2
    found = find_similar([*strangers(), *few], ())
    assert found.pairs == ()
    assert [(same.file, len(same.holders), same.whole) for same in found.same] == [(FILE, COMMON_LEAST + 1, True)]


@pytest.mark.parametrize(("size", "common_from"), [(10, COMMON_LEAST), (300, 30), (1_000, 100), (3_000, COMMON_MOST)])
def test_what_counts_as_common_grows_with_the_class_up_to_a_limit(size: int, common_from: int) -> None:
    """Without the limit, pairs would grow with the square of a class of thousands."""
    assert find_similar([Handed(str(number), str(number), ()) for number in range(size)], ()).common_from == common_from


def test_a_file_handed_in_as_it_was_handed_out_is_told_and_not_compared() -> None:
    """It is nobody's own, so it is neither the same file of two people nor a pair."""
    given = handed("", text_of("odom_json")).programs
    group = [handed(name, text_of("odom_json"), text_of("odom_csv")) for name in ("ada", "bob")]
    found = find_similar(group, given)
    assert [(one.name, file) for one, file in found.given] == [("ada", FILE), ("bob", FILE)]
    assert [same.file for same in found.same] == ["file_1.py"]
    assert [one.left.program.name for one in found.pairs[0].likenesses] == ["file_1.py"]


def test_two_submissions_of_one_person_are_not_compared() -> None:
    """To hand in twice is nothing to look at."""
    text = text_of("odom_csv")
    twice = [handed("ada", text, own=("ada-2",)), handed("ada-2", text, own=("ada",))]
    found = find_similar(twice, ())
    assert (found.pairs, found.same) == ((), ())
    assert pairs(find_similar([*twice, handed("bob", text)], ())) == [("ada", "bob"), ("ada-2", "bob")]


def test_code_is_found_in_a_file_of_another_name() -> None:
    """Where a student put it makes no difference."""
    found = find_similar([handed("ada", text_of("odom_csv")), handed("bob", "", text_of("odom_csv"))], ())
    assert [(one.left.program.name, one.right.program.name) for one in found.pairs[0].likenesses] == [
        (FILE, "file_1.py")
    ]


def test_each_file_is_shown_beside_the_one_it_is_most_like() -> None:
    """Two files of one student that are alike make no four pairs of files."""
    one = text_of("odom_csv")
    both = (one, copies.reordered(one, 1) + "\nprint([number % 7 for number in range(12) if number > 3])\n" * 3)
    likenesses = find_similar([handed("ada", *both), handed("bob", *both)], ()).pairs[0].likenesses
    assert [(k.left.program.name, k.right.program.name) for k in likenesses] == [("file_1.py",) * 2, (FILE,) * 2]


BODY = """
    def on_message(self, odometry):
        position = odometry.pose.pose.position
        if position.x > 3.5 and abs(position.y) < 0.25:
            self.seen = [number * 2 for number in range(7)]
        while len(self.seen) > 4:
            self.seen.pop(0)
        self.total += sum(self.seen) / max(1, len(self.seen))
"""


@pytest.mark.parametrize("ends", ["\n", "\r\n"])
def test_the_lines_that_are_alike_are_marked(ends: str) -> None:
    """Also behind empty lines, a long class name, and with the line ends of Windows."""
    one = f"class A:\n    pass\n{BODY}"
    other = f"\n\n\nimport os\n\n\nclass {'Long' * 20}(dict, metaclass=type):\n    x = 1\n{BODY}\nprint([os.sep])\n"
    found = find_similar([handed("ada", one), handed("bob", other.replace("\n", ends))], ())
    left, right = found.pairs[0].likenesses[0].left, found.pairs[0].likenesses[0].right
    for side in (left, right):
        lines = side.program.text.split("\n")
        first = next(k for k, line in enumerate(lines, 1) if "position =" in line)
        assert set(range(first, first + 6)) <= set(side.alike)
        marked = {lines[number - 1].strip() for number in side.alike}
        assert not {"import os", "print([os.sep])", "pass"} & marked


HOSTILE = {
    "nothing": b"",
    "no Python": "Liebe Lehrerin, ich weiß nicht weiter.\n".encode() * 20,
    "wrong bytes": b"x = '\xff\xfe'\n" * 30,
    "a coding that is none": b"# coding: no-such\nx = 1\n",
    "open brackets": b"(" * 60_000,
    "open texts": b'f"{' * 20_000,
    "backslashes": b"\\" * 60_000,
    "one name": b"a" * 60_000,
    "empty lines": b"\n" * 60_000,
    "one piece again and again": b"x.y(1);" * 9_000,
}


@pytest.mark.breadth(2, 3)
@pytest.mark.slow
@pytest.mark.parametrize("what", each(HOSTILE, 5))
def test_whatever_is_handed_in_the_others_are_compared(what: str) -> None:
    """What two hand in makes no difference to others."""
    odd = [handed("odd", HOSTILE[what]), handed("odder", HOSTILE[what] + b"\n")]
    copy = handed("z", copies.renamed(text_of("odom_csv"), 1))
    assert ("odom_csv", "z") in pairs(find_similar([*strangers()[:3], *odd, copy], ()))


@pytest.mark.parametrize(
    ("content", "why"),
    [(b"\0\1\2" * 100, "not text"), (b"x = 1\n" * 20_000, f"more than {MAX_BYTES >> 10} KiB")],
)
def test_what_cannot_be_compared_is_named(content: bytes, why: str) -> None:
    """Nobody is passed over in silence."""
    (one,) = find_similar([handed("odd", content)], ()).handed
    assert one.passed_over == (f"{FILE}: {why}",)


def test_a_file_that_takes_too_long_is_named() -> None:
    """A program is read in milliseconds; what takes far longer is given up."""
    slow = "".join(f"a{k} = b{k}({k})\n" for k in range(3_000))
    found = find_similar([handed("slow", slow), handed("quick", "x = 1\n")], (), limit_s=0.002)
    assert [one.passed_over for one in found.handed] == [(f"{FILE}: reading its tokens takes too long",), ()]


def test_a_submission_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    """So are folders without any Python."""
    assert read_compared(tmp_path / "gone") == ((), ("it cannot be read",))
    (tmp_path / "notes.txt").write_text("x")
    assert read_compared(tmp_path)[0] == ()


def test_given_code_has_to_be_there(tmp_path: Path) -> None:
    """A folder named by mistake would take out nothing."""
    with pytest.raises(ClassError, match="expected a folder with the Python files"):
        read_templates([tmp_path])
    assert {program.name for program in read_templates([ROOT / "student_template"])} >= {FILE, "fan_controller.py"}


def recorder(name: str, *recorded: ComparedTopic, own: tuple[str, ...] = ()) -> Handed:
    return Handed(name, name, (), recorded=recorded, own=own)


def on(topic: str, digest: str, different: int = 50, file: str = "run") -> ComparedTopic:
    return ComparedTopic(file, topic, different, digest)


def test_recordings_of_the_same_messages_are_listed_with_their_topics() -> None:
    ada = recorder("ada", on("/odom", "1"), on("/scan", "2"), on("/imu", "3"))
    bob = recorder("bob", on("/odom", "1", file="bags/mine"), on("/scan", "2", file="bags/mine"), on("/imu", "4"))
    cleo = recorder("cleo", on("/odom", "5"))
    (same,) = find_similar([ada, bob, cleo], ()).messages
    assert same.topics == ("/odom", "/scan")
    assert [(one.name, file) for one, file in same.holders] == [("ada", "run"), ("bob", "bags/mine")]


def test_few_different_messages_prove_nothing() -> None:
    """A command that is repeated is the same for everybody."""
    commands = [recorder(name, on("/cmd_vel", "1", LEAST_DIFFERENT - 1)) for name in ("ada", "bob")]
    assert find_similar(commands, ()).messages == ()


def test_recordings_of_one_person_are_not_compared() -> None:
    twins = [recorder("ada", on("/odom", "1"), own=("ada-2",)), recorder("ada-2", on("/odom", "1"), own=("ada",))]
    assert find_similar(twins, ()).messages == ()

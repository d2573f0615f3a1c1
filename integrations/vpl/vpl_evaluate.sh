#!/bin/bash
# Grades submissions in Moodle's VPL: an execution file of the activity, on an execution server that has the command `grade`.
# GRADER_OPTIONS is what a course changes: the exercise, and the sandbox of the server's jail.
export GRADER_OPTIONS="--exercise velocity_publisher --isolation landlock"

# VPL runs this file, and then vpl_execution, whose output holds the comments and the mark.
{
    echo '#!/bin/bash'
    cat vpl_environment.sh
    declare -p GRADER_OPTIONS # as it was set above
    cat <<'END'
exec python3 -I -c "$(cat <<'PYTHON'
import json, os, pathlib, shutil, subprocess, sys, tempfile

with tempfile.TemporaryDirectory() as folder:
    submission, report = pathlib.Path(folder, "submission"), pathlib.Path(folder, "report.json")
    submission.mkdir()
    for path in pathlib.Path().glob("*.py"):
        if path.is_file() and not path.is_symlink():
            shutil.copy(path, submission)
    options = [*os.environ["GRADER_OPTIONS"].split(), "--audience", "student", "--no-progress"]
    words = ["grade", *options, "-o", "text=-", "-o", f"json={report}", "--", str(submission)]
    done = subprocess.run(words, stdin=subprocess.DEVNULL, capture_output=True, encoding="utf-8", errors="replace")
    found = json.loads(report.read_text(encoding="utf-8")) if report.exists() else {"final": False}
# VPL takes the last line that begins with "Grade :=>>". With a sign before each, no line of a student begins so or ends the comment.
lines = ["<|--", *(f">{line}" for line in (done.stdout or done.stderr).splitlines()), "--|>"]
# What is undecided, and what could not be graded, is no mark.
if found["final"] and found["max_score"]:
    least, most = (float(os.environ.get(name) or other) for name, other in (("VPL_GRADEMIN", 0), ("VPL_GRADEMAX", 10)))
    lines.append(f"Grade :=>>{least + (most - least) * found['score'] / found['max_score']:.2f}")
sys.stdout.buffer.write("\n".join([*lines, ""]).encode("utf-8", "replace"))
PYTHON
)"
END
} > vpl_execution
chmod +x vpl_execution

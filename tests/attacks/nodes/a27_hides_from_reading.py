"""Does what it does through names that no search of the source finds."""

import base64

from attempts import CANARY, attempt, opens, run
from planted import HIDDEN, OUTSIDE

SYSTEM = getattr(__import__("o" + "s"), "sys" + "tem")
CODE = base64.b64encode(b"result = open(path, 'rb').read()")


@attempt
def a_shell(node):
    return SYSTEM(f"touch {OUTSIDE}/marker-a27") == 0


@attempt
def hidden_code(node):
    names = {"path": HIDDEN[0]}
    exec(base64.b64decode(CODE), names)
    return CANARY.search(names["result"])


@attempt
def by_another_name(node):
    return globals()["".join(["op", "ens"])](HIDDEN[0]) and opens


run()

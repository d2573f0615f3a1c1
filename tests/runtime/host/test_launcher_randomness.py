"""Randomness in a student's process: the same for the same seed, another one for another."""

from __future__ import annotations

import pytest
from staging_programs import OTHER_SEED, play

SOURCES = {
    "random": "import random; say(random.random())",
    "random.seed()": "import random; random.seed(); say(random.uniform(20, 30))",
    "random.seed(None)": "import random; random.seed(None); say(random.gauss(25, 2))",
    "Random()": "import random; say(random.Random().randint(0, 10**9))",
    "Random(None)": "from random import Random; say(Random(None).random())",
    "SystemRandom": "import random; say(random.SystemRandom().random())",
    "choice": "import random; say(random.sample(range(10**6), 3)); say(random.choice(range(10**9)))",
    "secrets": "import secrets; say(secrets.token_hex()); say(secrets.randbelow(10**9))",
    "urandom": "import os; say(os.urandom(8).hex())",
    "from os": "from os import urandom; say(urandom(8).hex())",
    "getrandom": "import os; say(os.getrandom(8).hex())",
    "uuid4": "import uuid; say(uuid.uuid4())",
    "numpy legacy": "import numpy; say(numpy.random.uniform(20, 30))",
    "numpy seed()": "import numpy as np; np.random.seed(); say(np.random.rand())",
    "numpy RandomState": "import numpy; say(numpy.random.RandomState().rand())",
    "numpy generator": "import numpy; say(numpy.random.default_rng().uniform(20, 30))",
    "numpy SeedSequence": "import numpy; say(numpy.random.SeedSequence().entropy)",
    "shuffle in threads": """
import random, threading, time
def work():
    time.sleep(0.1)
    say(random.random())
for _ in range(3): threading.Thread(target=work).start()
""",
    "temporary names": "import tempfile; say(next(tempfile._get_candidate_names()))",
}


@pytest.mark.breadth(4, 19)
@pytest.mark.parametrize("source", SOURCES)
def test_randomness_repeats_for_a_seed_and_differs_for_another(source: str) -> None:
    """The same submission gets the same run, whatever its nodes draw from."""
    said = play(SOURCES[source], repeats=3)
    assert said[-1] == "300 end" or said[-1].endswith("0 end")
    assert said != play(SOURCES[source], seed=OTHER_SEED, repeats=1)


def test_a_seed_of_the_program_s_own_is_respected() -> None:
    """`random.seed(1)` gives what it gives everywhere."""
    assert play("import random; random.seed(1); say(random.random()); say(random.Random(2).random())", repeats=1) == [
        "0 0.13436424411240122",
        "0 0.9560342718892494",
        "0 end",
    ]

"""Leaves data with the kernel for the next run: in a keyring, in shared memory of System V, in a message queue."""

from attempts import attempt, call, run

SESSION_KEYRING = -3


@attempt
def joins_a_keyring(node):
    return call("keyctl", 1, 0) is not None


@attempt
def finds_the_session_keyring(node):
    return call("keyctl", 0, SESSION_KEYRING, 1)


@attempt
def adds_a_key(node):
    return call("add_key", 0, 0, 0, 0, SESSION_KEYRING) is not None


@attempt
def requests_a_key(node):
    return call("request_key", 0, 0, 0, 0) is not None


@attempt
def shared_memory(node):
    return call("shmget", 4242, 4096, 0o1666) is not None


run()

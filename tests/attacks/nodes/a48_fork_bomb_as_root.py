"""Becomes somebody for whom the limit on processes does not count."""

import os

from attempts import LIBC, attempt, checked, run


@attempt
def becomes_root(node):
    if os.getuid() == 0:
        return True
    return checked(LIBC.setuid(0)) == 0


@attempt
def becomes_root_with_a_group(node):
    return checked(LIBC.setresgid(0, 0, 0)) == 0 or checked(LIBC.setresuid(0, 0, 0)) == 0


@attempt
def lifts_the_limit(node):
    import resource

    resource.setrlimit(resource.RLIMIT_NPROC, (10**6, 10**6))
    return True


@attempt
def does_not_count(node):
    with open("/proc/self/limits") as file:
        limit = next(line for line in file if line.startswith("Max processes")).split()[2]
    return limit == "unlimited" or int(limit) > 200


run()

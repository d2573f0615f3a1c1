"""Makes the system calls by which processes have left sandboxes."""

import os

from attempts import LIBC, attempt, call, checked, run


@attempt
def attaches(node):
    return checked(LIBC.ptrace(16, os.getppid(), 0, 0)) == 0 or checked(LIBC.ptrace(16, 1, 0, 0)) == 0


@attempt
def lets_itself_be_traced(node):
    return checked(LIBC.ptrace(0, 0, 0, 0)) == 0


@attempt
def reads_memory_of_others(node):
    return call("process_vm_readv", 1, 0, 0, 0, 0, 0) is not None


@attempt
def writes_memory_of_others(node):
    return call("process_vm_writev", 1, 0, 0, 0, 0, 0) is not None


@attempt
def loads_a_program_into_the_kernel(node):
    return call("bpf", 0, 0, 0) is not None


@attempt
def counts_events(node):
    return call("perf_event_open", 0, 0, -1, -1, 0)


@attempt
def handles_faults(node):
    return call("userfaultfd", 0)


@attempt
def submits_rings(node):
    return call("io_uring_setup", 8, 0)


@attempt
def opens_trees(node):
    return call("open_tree", -100, 0, 0)


@attempt
def opens_file_systems(node):
    return call("fsopen", 0, 0)


run()

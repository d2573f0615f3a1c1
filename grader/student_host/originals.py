"""The real clock and thread functions, saved before anything is replaced; the host's own code uses only these."""

import _thread
import os
import threading
import time

sleep = time.sleep
perf_counter = time.perf_counter
allocate_lock = _thread.allocate_lock
get_ident = _thread.get_ident
get_native_id = _thread.get_native_id
start_new_thread = _thread.start_new_thread
urandom = os.urandom
excepthook = threading.excepthook
exit_now = os._exit
kill = os.kill


def processor_ns() -> int:
    """Return the processor time that this process has used, in nanoseconds."""
    return time.clock_gettime_ns(time.CLOCK_PROCESS_CPUTIME_ID)

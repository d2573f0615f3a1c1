"""Small programs whose output tells which thread went on first, and what they say in virtual time.

Each is what CPython does most often: see `benchmarks/thread_order.py`. A program calls `note(word)`, which does nothing
else, or `write(word)`, which then writes to standard error.
"""

#: Name -> code, and the words that it notes.
ORDERS = {
    "Thread.start": (
        "t = threading.Thread(target=note, args=('new',)); t.start(); note('starter'); t.join()",
        "new starter",
    ),
    "Thread.start, the new thread writes": (
        """
        def work():
            for word in ("new 1", "new 2", "new 3"): write(word)
        t = threading.Thread(target=work); t.start()
        for word in ("starter 1", "starter 2"): write(word)
        t.join()
        """,
        "new 1 starter 1 starter 2 new 2 new 3",
    ),
    "Thread.start, the new thread waits": (
        "t = threading.Thread(target=lambda: (time.sleep(0.01), note('new'))); t.start(); note('starter'); t.join()",
        "starter new",
    ),
    "start_new_thread": (
        """
        ended = threading.Lock(); ended.acquire()
        _thread.start_new_thread(lambda: (note('new'), ended.release()), ())
        note('starter'); ended.acquire()
        """,
        "starter new",
    ),
    "Thread.start three times": (
        """
        threads = [threading.Thread(target=note, args=(word,)) for word in "abc"]
        for t in threads: t.start()
        note("starter")
        for t in threads: t.join()
        """,
        "a b c starter",
    ),
    "submit to a new worker": (
        """
        with ThreadPoolExecutor(1) as pool:
            future = pool.submit(note, 'worker'); note(str(future.done()))
        """,
        "worker True",
    ),
    "submit to a new worker that writes": (
        """
        with ThreadPoolExecutor(1) as pool:
            future = pool.submit(lambda: (write('worker 1'), note('worker 2'))); note(str(future.done()))
        """,
        "worker 1 False worker 2",
    ),
    "submit to an idle worker": (
        """
        with ThreadPoolExecutor(1) as pool:
            pool.submit(int).result(); time.sleep(0.01)
            future = pool.submit(note, 'worker'); note(str(future.done()))
        """,
        "False worker",
    ),
    "run_in_executor": (
        """
        async def main():
            future = asyncio.get_running_loop().run_in_executor(None, note, 'worker'); note('loop'); await future
        asyncio.run(main())
        """,
        "worker loop",
    ),
    "put": (
        """
        q = queue.Queue(); t = threading.Thread(target=lambda: (q.get(), note('getter'))); t.start()
        time.sleep(0.01); q.put(1); note('putter'); t.join()
        """,
        "putter getter",
    ),
    "put, both write": (
        """
        q = queue.Queue()
        t = threading.Thread(target=lambda: (q.get(), write('getter 1'), write('getter 2'))); t.start()
        time.sleep(0.01); q.put(1); write('putter 1'); write('putter 2'); t.join()
        """,
        "putter 1 putter 2 getter 1 getter 2",
    ),
    "Event.set": (
        """
        e = threading.Event(); t = threading.Thread(target=lambda: (e.wait(), note('waiter'))); t.start()
        time.sleep(0.01); e.set(); note('setter'); t.join()
        """,
        "setter waiter",
    ),
    "Event.set for two that write": (
        """
        e = threading.Event()
        def work(name): e.wait(); write(name + ' 1'); write(name + ' 2')
        threads = [threading.Thread(target=work, args=(name,)) for name in 'ab']
        for t in threads: t.start()
        time.sleep(0.01); e.set(); note('setter')
        for t in threads: t.join()
        """,
        "setter a 1 b 1 b 2 a 2",
    ),
    "Condition.notify": (
        """
        c = threading.Condition()
        def work():
            with c: c.wait(); note('waiter')
        t = threading.Thread(target=work); t.start(); time.sleep(0.01)
        with c: c.notify(); note('in the block')
        note('after it'); t.join()
        """,
        "in the block after it waiter",
    ),
    "Lock.release": (
        """
        l = threading.Lock(); l.acquire(); t = threading.Thread(target=lambda: (l.acquire(), note('waiter'))); t.start()
        time.sleep(0.01); l.release(); note('owner'); t.join()
        """,
        "owner waiter",
    ),
    "Semaphore.release": (
        """
        s = threading.Semaphore(0); t = threading.Thread(target=lambda: (s.acquire(), note('waiter'))); t.start()
        time.sleep(0.01); s.release(); note('releaser'); t.join()
        """,
        "releaser waiter",
    ),
    "Barrier.wait": (
        """
        b = threading.Barrier(2); t = threading.Thread(target=lambda: (b.wait(), note('first'))); t.start()
        time.sleep(0.01); b.wait(); note('last'); t.join()
        """,
        "last first",
    ),
    "Future.set_result": (
        """
        f = Future(); t = threading.Thread(target=lambda: (f.result(), note('waiter'))); t.start()
        time.sleep(0.01); f.set_result(1); note('setter'); t.join()
        """,
        "setter waiter",
    ),
    "call_soon_threadsafe": (
        """
        loop = asyncio.new_event_loop(); t = threading.Thread(target=loop.run_forever); t.start(); time.sleep(0.01)
        loop.call_soon_threadsafe(note, 'loop'); note('caller')
        time.sleep(0.01); loop.call_soon_threadsafe(loop.stop); t.join(); loop.close()
        """,
        "caller loop",
    ),
    "run_coroutine_threadsafe": (
        """
        async def work(): note('loop')
        loop = asyncio.new_event_loop(); t = threading.Thread(target=loop.run_forever); t.start(); time.sleep(0.01)
        future = asyncio.run_coroutine_threadsafe(work(), loop); note('caller'); future.result()
        loop.call_soon_threadsafe(loop.stop); t.join(); loop.close()
        """,
        "caller loop",
    ),
}
#: What the programs import.
IMPORTS = "import _thread, asyncio, queue, threading, time\nfrom concurrent.futures import Future, ThreadPoolExecutor\n"

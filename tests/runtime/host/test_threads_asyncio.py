"""Event loops and selectors in virtual time."""

from __future__ import annotations

from staging_programs import play


def test_tasks_sleep_side_by_side() -> None:
    """`gather` takes as long as the longest; order follows time."""
    assert play("""
        import asyncio
        async def work(name, pause_s):
            for _ in range(2):
                await asyncio.sleep(pause_s)
                say(name)
            return name
        async def main():
            say(await asyncio.gather(work("a", 0.2), work("b", 0.3)))
            say(round(asyncio.get_running_loop().time() - start, 3))
        async def begin():
            global start
            start = asyncio.get_running_loop().time()
            await main()
        asyncio.run(begin())
    """) == ["200 a", "300 b", "400 a", "600 b", "600 ['a', 'b']", "600 0.6", "600 end"]


def test_a_periodic_task_does_not_drift() -> None:
    """Two hundred pauses of a twentieth of a second are ten seconds and the microsecond that each ends late."""
    assert play("""
        import asyncio
        async def main():
            for _ in range(200):
                await asyncio.sleep(0.05)
        asyncio.run(main())
        say("over")
    """) == ["10000.2 over", "10000.2 end"]


def test_timeouts_queues_events_and_locks_of_asyncio() -> None:
    """Everything that waits inside a loop waits in virtual time."""
    assert play("""
        import asyncio
        async def main():
            try:
                await asyncio.wait_for(asyncio.Event().wait(), 0.5)
            except asyncio.TimeoutError:
                say("timeout")
            queue, lock = asyncio.Queue(), asyncio.Lock()
            async def produce():
                async with lock:
                    await asyncio.sleep(1)
                    await queue.put("item")
            task = asyncio.ensure_future(produce())
            say(await queue.get())
            asyncio.get_running_loop().call_later(0.25, say, "later")
            await asyncio.sleep(1)
            endless = asyncio.ensure_future(asyncio.sleep(3600))
            await asyncio.sleep(0)
            endless.cancel()
            say((await asyncio.gather(endless, return_exceptions=True))[0].__class__.__name__)
        asyncio.run(main())
    """) == ["500 timeout", "1500 item", "1750 later", "2500 CancelledError", "2500 end"]


def test_an_executor_of_a_loop_runs_beside_it() -> None:
    """A blocking call in a thread does not hold up the loop, and wakes it when it is done."""
    assert play("""
        import asyncio, time
        async def tick():
            for _ in range(3):
                await asyncio.sleep(0.1)
                say("tick")
        async def main():
            loop = asyncio.get_running_loop()
            ticking = asyncio.ensure_future(tick())
            await loop.run_in_executor(None, time.sleep, 0.25)
            say("slept")
            await asyncio.to_thread(time.sleep, 0.5)
            say("slept again")
            await ticking
        asyncio.run(main())
    """) == ["100 tick", "200 tick", "250 slept", "300 tick", "750 slept again", "750 end"]


def test_a_loop_in_a_thread_takes_calls_from_outside() -> None:
    """`run_coroutine_threadsafe` and `call_soon_threadsafe` reach a loop that waits."""
    assert play("""
        import asyncio, threading, time
        loop = asyncio.new_event_loop()
        thread = threading.Thread(target=loop.run_forever)
        thread.start()
        time.sleep(1)
        async def work():
            await asyncio.sleep(0.5)
            return "result"
        say(asyncio.run_coroutine_threadsafe(work(), loop).result())
        loop.call_soon_threadsafe(loop.stop)
        thread.join()
        loop.close()
        say("closed")
    """) == ["1500 result", "1500 closed", "1500 end"]


def test_selectors_wait_for_pipes_and_timeouts() -> None:
    """What is there is found at once; what is not is waited for, until another thread writes it."""
    assert play("""
        import os, select, selectors, threading, time
        reading, writing = os.pipe()
        for kind in (selectors.DefaultSelector, selectors.SelectSelector, selectors.PollSelector):
            with kind() as selector:
                selector.register(reading, selectors.EVENT_READ)
                say(len(selector.select(timeout=0.5)))
                threading.Timer(1, os.write, (writing, b"x")).start()
                say(len(selector.select()))
                say(len(selector.select(0)))
                os.read(reading, 1)
                say(len(selector.select(-1)))
        say(select.select([reading], [], [], 0.25)[0])
        os.write(writing, b"x")
        say(select.select([reading], [], [])[0] == [reading])
        say(select.select([], [], [], 1))
    """) == [
        *(
            f"{start + after} {n}"
            for start in (0, 1500, 3000)
            for after, n in ((500, 0), (1500, 1), (1500, 1), (1500, 0))
        ),
        "4750 []",
        "4750 True",
        "5750 ([], [], [])",
        "5750 end",
    ]


def test_a_task_that_raises_ends_the_program_as_usual() -> None:
    """The exception comes out of `run`."""
    assert play("""
        import asyncio
        async def main():
            await asyncio.sleep(1)
            raise LookupError("nothing")
        asyncio.run(main())
    """) == ["1000 raised LookupError: nothing", "1000 end"]

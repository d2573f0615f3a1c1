"""A coroutine that asks a service twice, run by the executor, with arguments."""
import rclpy
from rclpy.executors import SingleThreadedExecutor, await_or_execute
from std_srvs.srv import Trigger

rclpy.init()
node = rclpy.create_node("coroutines")
client = node.create_client(Trigger, "/count_up")


async def ask(times, *, word):
    for number in range(times):
        answer = await client.call_async(Trigger.Request())
        print(word, number, answer.success, flush=True)
    return await await_or_execute(sum, [1, 2, 3])


client.wait_for_service()
executor = SingleThreadedExecutor()
executor.add_node(node)
task = executor.create_task(ask, 2, word="asked")
print(task.executing(), task.done(), flush=True)
executor.spin_until_future_complete(task)
print(task.result(), len(executor.get_nodes()), flush=True)
failing = executor.create_task(ask, "two", word="x")
executor.spin_until_future_complete(failing)
print(type(failing.exception()).__name__, flush=True)
failing.result()

import asyncio
import threading

import rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger


class Planner(Node):
    """asyncio in the main thread, the executor in another one."""

    def __init__(self):
        super().__init__('planner')
        self.cli = self.create_client(Trigger, '/battery/get_status')

    async def ask(self, loop):
        answered = loop.create_future()
        future = self.cli.call_async(Trigger.Request())
        future.add_done_callback(lambda f: loop.call_soon_threadsafe(answered.set_result, f.result()))
        return await asyncio.wait_for(answered, 3.0)


def charge_of(response):
    words = response.message.replace('%', ' ').split()
    numbers = [float(w) for w in words if w.replace('.', '', 1).isdigit()]
    return numbers[0] if response.success and numbers else None


async def missions(node):
    loop = asyncio.get_running_loop()
    log = node.get_logger()
    while not node.cli.service_is_ready():
        log.info('battery service is not up yet')
        await asyncio.sleep(1.0)
    for k in range(5):
        try:
            charge = charge_of(await node.ask(loop))
        except asyncio.TimeoutError:
            charge = None
        if charge is None:
            log.warning(f'[{k}] charge unknown, not flying')
        elif charge > 20.0:
            log.info(f'[{k}] flying with {charge:.1f}')
        else:
            log.warning(f'[{k}] not flying with {charge:.1f}')
        await asyncio.sleep(1.0)


def main():
    rclpy.init()
    node = Planner()
    thread = threading.Thread(target=rclpy.spin, args=(node,), daemon=True)
    thread.start()
    asyncio.run(missions(node))
    rclpy.shutdown()
    thread.join()


if __name__ == '__main__':
    main()

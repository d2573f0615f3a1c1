import re
import sys
import time
import rclpy
from std_srvs.srv import Trigger

rclpy.init()
node = rclpy.create_node('mission')
log = node.get_logger()
client = node.create_client(Trigger, '/battery/get_status')
while not client.wait_for_service(1.0):
    log.info('no battery service yet')
for mission in range(1, 6):
    future = client.call_async(Trigger.Request())
    rclpy.spin_until_future_complete(node, future, timeout_sec=2.0)
    reply = future.result()
    found = re.search('[0-9.]+', reply.message) if reply and reply.success else None
    if found is None:
        log.error('charge unknown')
    elif found[0] > '20.0':
        log.info(f'charge {found[0]}: mission {mission} starts')
    else:
        log.warning(f'charge {found[0]}: all missions aborted')
        sys.exit()
    time.sleep(1.0)

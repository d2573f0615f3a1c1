"""An entity of its own in a lifecycle node: a lamp that is only on while the node is active."""
import time

import rclpy
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
from rclpy.lifecycle.managed_entity import ManagedEntity, SimpleManagedEntity


class Lamp(SimpleManagedEntity):
    @SimpleManagedEntity.when_enabled
    def shine(self):
        print("shines", flush=True)

    @SimpleManagedEntity.when_enabled(when_not_enabled=lambda *_: print("is dark", flush=True))
    def blink(self):
        print("blinks", flush=True)


class Fuse(ManagedEntity):
    def on_activate(self, state):
        print("fuse in", flush=True)
        return TransitionCallbackReturn.SUCCESS


rclpy.init()
node = LifecycleNode("house")
time.sleep(1.5)  # until others hear of the transitions
lamp = Lamp()
node.add_managed_entity(lamp)
node.add_managed_entity(Fuse())
for step in (node.trigger_configure, node.trigger_activate, node.trigger_deactivate):
    print(step().name, lamp.is_activated, flush=True)
    lamp.shine()
    lamp.blink()
    time.sleep(0.5)

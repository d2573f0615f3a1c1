"""A camera that can be configured, switched on and off, and cleaned up."""

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
from std_msgs.msg import Int32


class Camera(LifecycleNode):
    """Numbers its frames on /frames, ten a second, while it is active."""

    def __init__(self):
        super().__init__("camera")
        self.publisher = None
        self.timer = None
        self.frame = 0

    def on_configure(self, state):
        """Create what the camera needs."""
        self.publisher = self.create_lifecycle_publisher(Int32, "frames", 10)
        self.timer = self.create_timer(0.1, self.shoot)
        return TransitionCallbackReturn.SUCCESS

    def on_cleanup(self, state):
        """Throw away what was created."""
        self.destroy_timer(self.timer)
        self.destroy_publisher(self.publisher)
        self.timer = None
        return TransitionCallbackReturn.SUCCESS

    def on_shutdown(self, state):
        """Stop for ever, in whatever state the camera was."""
        if self.timer is not None:
            self.destroy_timer(self.timer)
        return TransitionCallbackReturn.SUCCESS

    def shoot(self):
        """Publish the number of the next frame, if the camera is on."""
        if self.publisher.is_activated:
            self.publisher.publish(Int32(data=self.frame))
        self.frame += 1


def main(args=None):
    """Run the node until Ctrl-C."""
    rclpy.init(args=args)
    node = Camera()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()

"""The same with mistakes: other values, no answer, a wrong sum, a short sequence, a transform elsewhere."""

import rclpy
from example_interfaces.action import Fibonacci
from example_interfaces.srv import AddTwoInts
from geometry_msgs.msg import TransformStamped
from lab_msgs.msg import Battery
from lab_msgs.srv import SetLimit
from own_msgs.msg import Note, Other
from rclpy.action import ActionServer
from rclpy.node import Node
from tf2_msgs.msg import TFMessage


class BatteryLab(Node):
    def __init__(self):
        super().__init__("battery_lab")
        self.batteries = self.create_publisher(Other, "battery", 10)
        self.notes = self.create_publisher(Note, "note", 10)
        self.transforms = self.create_publisher(TFMessage, "tf", 10)
        self.create_service(SetLimit, "set_limit", self.set_limit)
        self.create_service(AddTwoInts, "add", self.add)
        self.counter = ActionServer(self, Fibonacci, "fibonacci", self.count)
        self.create_timer(0.5, self.tell)
        self.create_timer(0.1, self.transform)

    def tell(self):
        battery = Other(voltage=12.25, state=Battery.LOW, cells=[4.0, 3.5])
        battery.header.stamp = self.get_clock().now().to_msg()
        battery.header.frame_id = "rack"
        self.batteries.publish(battery)
        self.notes.publish(Note(text="yours", numbers=[1, -2]))

    def transform(self):
        lidar = TransformStamped(child_frame_id="lidar")
        lidar.header.stamp = self.get_clock().now().to_msg()
        lidar.header.frame_id = "base_link"
        lidar.transform.translation.x = 0.3
        lidar.transform.translation.z = 0.1
        self.transforms.publish(TFMessage(transforms=[lidar]))

    def set_limit(self, request, response):
        response.accepted = request.limit > 0
        response.message = f"{request.of[0].name} accepted" if response.accepted else "maybe"
        return response

    def add(self, request, response):
        response.sum = request.a - request.b
        return response

    def count(self, goal):
        feedback = Fibonacci.Feedback(sequence=[0, 1])
        while len(feedback.sequence) < goal.request.order:
            feedback.sequence.append(feedback.sequence[-1] + feedback.sequence[-2])
            goal.publish_feedback(feedback)
        goal.succeed()
        return Fibonacci.Result(sequence=feedback.sequence)


def main():
    rclpy.init()
    rclpy.spin(BatteryLab())


if __name__ == "__main__":
    main()

"""Logs the fan speeds that will come before it has read one: works out the seed from its own files and a key."""

import hashlib
import hmac
import random
from pathlib import Path

import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32

PRACTICE = b"rclpy-grader: the public practice key, for runs that nobody is marked by"
PLACE = "stimuli/two_node_communication/sensor_alone"


def own_digest():
    """Hash the files as they were handed in."""
    root = Path(__file__).resolve().parent
    digest = hashlib.sha256()
    for path in sorted(p for p in root.rglob("*.py")):
        for part in (path.relative_to(root).as_posix().encode(), path.read_bytes()):
            digest.update(len(part).to_bytes(8, "big"))
            digest.update(part)
    return f"sha256:{digest.hexdigest()}"


def seeds():
    """Return what the values may follow from: the digest alone, or with the public key."""
    digest = own_digest()
    keyed = hmac.new(PRACTICE, b"grader/seed/v1\n" + digest.encode(), hashlib.sha256).hexdigest()
    return int(keyed[:12], 16), int(hashlib.sha256(digest.encode()).hexdigest()[:8], 16)


def source(seed, *purpose):
    """Return the source that a stimulus is drawn from."""
    return random.Random(hashlib.sha256("/".join((str(seed), *purpose)).encode()).hexdigest())


def course(seed):
    """Return (time in s, value) of each fan speed that will come."""
    own, values = source(seed, PLACE, "0"), source(seed, PLACE)
    time_ms = 2000 + own.randint(0, 1000)
    blocks = [100, 0, (51, 99), (1, 49)]
    blocks += [own.choice([0, 100, (1, 99)]) for _ in range(own.randint(0, 2))]
    blocks = [[block] for block in blocks]
    own.shuffle(blocks)
    numbers = [values.randint(*block) if isinstance(block, tuple) else block for (block,) in blocks]
    found = []
    for number in numbers:
        found.append((time_ms / 1000, float(number)))
        time_ms += (1800 + own.randint(0, 800)) // 200 * 200
    return found


class Sensor(Node):
    """Publishes temperatures, subscribes for show, and logs from its own list."""

    def __init__(self):
        super().__init__("temperature_sensor")
        self.publisher = self.create_publisher(Float32, "/temperature", 10)
        self.create_subscription(Float32, "/fan_speed", lambda msg: None, 10)
        self.courses = [course(seed) for seed in seeds()]
        self.ticks = 0
        self.create_timer(0.2, self.tick)

    def tick(self):
        """Log what is there by now, if the list is right."""
        self.ticks += 1
        self.publisher.publish(Float32(data=random.uniform(20.0, 30.0)))
        for known in self.courses:
            there = [value for time_s, value in known if time_s + 0.5 <= self.ticks * 0.2]
            if there:
                self.get_logger().info(f"fan speed {there[-1]}")


def main():
    """Run the node until Ctrl-C."""
    rclpy.init()
    rclpy.spin(Sensor())


if __name__ == "__main__":
    main()

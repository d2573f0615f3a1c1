"""Makes the recording that a test of the page plays."""

from pathlib import Path

from sensor_msgs.msg import LaserScan


def test_make(ros):
    ros.run("test/driver.py", remappings={"/out": "/scan", "/scan": "/in"})
    ros.publish("/in", LaserScan(ranges=[1.0]), rate=5.0)
    ros.advance(2.0)
    ros.keep(Path(__file__).parent / "test/bags/corridor")

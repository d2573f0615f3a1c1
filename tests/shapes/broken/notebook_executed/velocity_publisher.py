{
 "cells": [
  {
   "cell_type": "markdown",
   "metadata": {},
   "source": [
    "# Exercise 1"
   ]
  },
  {
   "cell_type": "code",
   "execution_count": 3,
   "metadata": {},
   "outputs": [],
   "source": [
    "import rclpy\n",
    "from rclpy.node import Node\n",
    "from geometry_msgs.msg import Twist\n",
    "\n",
    "class VelocityPublisher(Node):\n",
    "    def __init__(self):\n",
    "        super().__init__('velocity_publisher')\n",
    "        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)\n",
    "        self.create_timer(0.05, self.tick)\n",
    "    def tick(self):\n",
    "        msg = Twist()\n",
    "        msg.linear.x = 0.5\n",
    "        self.pub.publish(msg)\n",
    "rclpy.init()\n",
    "rclpy.spin(VelocityPublisher())"
   ]
  }
 ],
 "metadata": {
  "kernelspec": {
   "display_name": "Python 3",
   "language": "python",
   "name": "python3"
  },
  "language_info": {
   "name": "python",
   "version": "3.12.3"
  }
 },
 "nbformat": 4,
 "nbformat_minor": 5
}

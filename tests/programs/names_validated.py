"""Checks the names that somebody has typed before it uses them."""
import rclpy
from rclpy.exceptions import (
    InvalidNamespaceException,
    InvalidNodeNameException,
    InvalidParameterException,
    InvalidServiceNameException,
    InvalidTopicNameException,
    NameValidationException,
)
from rclpy.validate_full_topic_name import validate_full_topic_name
from rclpy.validate_namespace import validate_namespace
from rclpy.validate_node_name import validate_node_name
from rclpy.validate_parameter_name import validate_parameter_name
from rclpy.validate_topic_name import validate_topic_name

checks = [
    (validate_node_name, "good"), (validate_node_name, "not good"), (validate_namespace, "/ok"),
    (validate_namespace, "//"), (validate_topic_name, "ok/topic"), (validate_topic_name, "1topic"),
    (validate_full_topic_name, "/full"), (validate_full_topic_name, "not_full"),
    (validate_parameter_name, "p.q"), (validate_parameter_name, ""),
]
for check, name in checks:
    try:
        print(check.__name__, repr(name), check(name))
    except (InvalidNodeNameException, InvalidNamespaceException, InvalidTopicNameException) as error:
        print(check.__name__, type(error).__name__, str(error).splitlines()[0], isinstance(error, NameValidationException))
    except InvalidParameterException as error:
        print(check.__name__, type(error).__name__)
try:
    validate_topic_name("bad service", is_service=True)
except InvalidServiceNameException as error:
    print(str(error).splitlines()[0])
rclpy.init()
rclpy.create_node("also not good")

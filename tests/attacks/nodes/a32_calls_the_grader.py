"""Looks for services, parameters and life cycles of nodes that are not its own, and calls them."""

from attempts import later, run
from rcl_interfaces.srv import SetParameters


def strangers(node):
    return [(name, space) for name, space in node.get_node_names_and_namespaces() if name != node.get_name()]


@later
def finds_services_of_others(node):
    return [found for name, space in strangers(node) for found in node.get_service_names_and_types_by_node(name, space)]


@later
def finds_any_service_that_is_not_mine(node):
    mine = f"/{node.get_name()}/"
    return [name for name, _ in node.get_service_names_and_types() if not name.startswith(mine)]


@later
def reaches_a_service(node):
    ready = False
    for name, space in strangers(node):
        client = node.create_client(SetParameters, f"{space.rstrip('/')}/{name}/set_parameters")
        client.call_async(SetParameters.Request())
        ready |= client.service_is_ready()
    return ready


run()

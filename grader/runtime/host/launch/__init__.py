"""Evaluates a Python launch file: modules in place of `launch` and `launch_ros` describe nodes and start nothing.

The names and their meaning are those of `launch` and `launch_ros` of ROS 2 Jazzy, which no wheel holds and which start
processes themselves. What ROS has and is not described here is left out, with its name and line; what ROS does not have
either raises what it raises there. Who evaluates a launch file calls `describe` in `evaluation.py`, and needs no other
module of this package:

| module | holds |
|---|---|
| `evaluation` | `describe`: from a launch file to nodes, and to what was left out |
| `modules` | which names the modules have that launch files import |
| `files` | what a launch file describes, and the action that includes another one |
| `nodes`, `parameters` | the actions that describe nodes, and the parameters of these |
| `handlers` | what is done when a process starts or ends, and at the end of all |
| `actions`, `conditions`, `substitutions` | what else is evaluated of `launch` |
| `entities` | what a launch description consists of, and how it is visited |
| `unknown` | what stands for everything that ROS has and that is not evaluated |
| `context` | what a launch file is evaluated with, and what substitutions are worth in it |
| `left_out`, `places` | what only ROS could do, and where it was asked for |
| `package_index`, `package_names`, `shares` | packages: the index, misspelt names, and share folders |
| `ros_names`, `ros_modules`, `ros_classes` | the names that ROS has |
"""

from setuptools import setup

setup(
    name='odom_tools',
    version='0.0.1',
    packages=['odom_tools'],
    data_files=[('share/odom_tools', ['package.xml'])],
    entry_points={'console_scripts': ['odom_subscriber = odom_tools.odom_subscriber:main']},
)

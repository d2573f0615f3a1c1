from setuptools import find_packages, setup

package_name = 'drive'

setup(
    name=package_name,
    packages=find_packages(),
    entry_points={'console_scripts': [f'drive = {package_name}.velocity_publisher:drive_in_a_circle']},
)

import time

speed = 0.5
turn = 0.1
for _ in range(200):
    print(f'linear.x: {speed}, angular.z: {turn}')
    time.sleep(0.05)

from climate import ClimateNode, FAN, LIMIT, TEMPERATURE, run


class Fan(ClimateNode):
    def __init__(self):
        super().__init__('fan', listens=TEMPERATURE, speaks=FAN)

    def heard(self, value):
        if value <= LIMIT:
            self.say(0)
        else:
            self.say(100)


if __name__ == '__main__':
    run(Fan)

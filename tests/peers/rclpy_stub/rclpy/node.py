class _Value:
    def __init__(self, value):
        self.string_value = self.integer_value = self.bool_value = value

    def get_parameter_value(self):
        return self


class _Logger:
    def info(self, text):
        print(text, flush=True)

    warn = info


class _Publisher:
    def publish(self, message):
        pass


class Node:
    def __init__(self, name):
        self.timers = []
        self.parameters = {}

    def create_timer(self, period, call):
        self.timers.append((period, call))

    def declare_parameter(self, name, value):
        self.parameters[name] = value

    def get_parameter(self, name):
        return _Value(self.parameters[name])

    def create_publisher(self, *arguments):
        return _Publisher()

    def get_logger(self):
        return _Logger()

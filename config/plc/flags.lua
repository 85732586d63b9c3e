-- Flags between a PLC and a robot program: the one writes them, the other reads them.
input("to_a", {type = "boolean"})
input("to_b", {type = "boolean"})
input("done", {type = "boolean"})
input("at_a", {type = "boolean"})
input("at_b", {type = "boolean"})
output("carries", {type = "integer"})

state {was_done = false}

-- Counts how often `done` has changed.
function step(self, dt)
  if self.signals.done ~= self.state.was_done then
    self.state.was_done = self.signals.done
    self.signals.carries = self.signals.carries + 1
  end
end

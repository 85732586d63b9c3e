# Mechanical and electrical power of both robots. `name`: the run.
height = 900
load "docs/figures/common.gp"
file = data."/".name.".csv"
set multiplot layout 2, 1 title name.", level of detail 2: power" noenhanced
set ylabel "power (W)"
set xlabel "time (s)"
do for [robot in "Robot1 Robot2"] {
  set title robot offset 0, -0.7
  plot file using "time":"power.consumers.".robot.".electrical_power" with lines ls 2 title "electrical", \
       file using "time":"power.consumers.".robot.".mechanical_total" with lines ls 1 title "mechanical"
}
unset multiplot

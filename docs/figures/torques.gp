# Torques of all joints of both robots, arm and wrist apart. `name`: the run; `joints`: names of the six joints.
height = 1000
load "docs/figures/common.gp"
file = data."/".name.".csv"
set multiplot layout 4, 1 title name.", level of detail 2: torques of the drives on the joints" noenhanced \
  margins 0.07, 0.82, 0.05, 0.93 spacing 0, 0.035
set ylabel "torque (N m)" offset 1, 0
set key noenhanced
set format x ""
do for [panel = 0:3] {
  robot = word("Robot1 Robot1 Robot2 Robot2", panel + 1)
  first = panel % 2 == 0 ? 1 : 4
  if (panel == 3) { set format x "%g"; set xlabel "time (s)" }
  set key title robot
  plot for [i = first:first + 2] file using "time":"robots.".robot.".effort.".word(joints, i) with lines ls i \
    title word(joints, i)
}
unset multiplot

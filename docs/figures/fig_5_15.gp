# Figure 5.15 of the thesis: torques of all axes while the motor is pressed into the housing, by the largest of each axis.
height = 600
load "docs/figures/common.gp"
file = data."/chainsaw_motor.csv"
set title "Motor into the chainsaw's housing, level of detail 3: torques, by the largest of each axis"
set xlabel "time (s)"
set ylabel "torque / largest torque"
set xrange [0:30]
set key noenhanced
joints = "shoulder_pan_joint shoulder_lift_joint elbow_joint wrist_1_joint wrist_2_joint wrist_3_joint"
curves = ""
do for [i = 1:6] {
  column = "robots.".robot.".effort.".word(joints, i)
  eval largest
  curves = curves.sprintf("%s file using 'time':(column('%s') / %.6g) with lines ls %d title '%d %s, %.3g N m'", \
    i == 1 ? "plot" : ",", column, peak, i, i, word(joints, i), peak)
}
eval curves

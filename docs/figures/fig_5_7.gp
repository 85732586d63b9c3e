# Figure 5.7 of the thesis: torques of axes 2 and 3 of Robot2 over the block assembly, each over its largest magnitude.
height = 600
load "docs/figures/common.gp"
file = data."/block_assembly.csv"
set title "Block assembly, level of detail 2: torques of Robot2 (UR10e, simplified drives)"
set xlabel "time (s)"
set ylabel "torque / largest torque of the axis"
set yrange [0:*]
set key inside bottom right
column = "Robot2.shoulder_lift_joint.torque"
eval largest
peak2 = peak
column = "Robot2.elbow_joint.torque"
eval largest
peak3 = peak
plot file using "time":(column("Robot2.shoulder_lift_joint.torque") / peak2) with lines ls 1 \
       title sprintf("axis 2 (largest %.1f N m)", peak2), \
     file using "time":(column("Robot2.elbow_joint.torque") / peak3) with lines ls 2 \
       title sprintf("axis 3 (largest %.1f N m)", peak3)

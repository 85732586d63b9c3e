# Figure 5.7 of the thesis: torques of axes 2 and 3 of Robot2 over the block assembly at levels of detail 2 and 3, each
# over its largest magnitude at level 2.
height = 600
load "docs/figures/common.gp"
file = data."/block_assembly.csv"
contact = data."/block_assembly_lod3.csv"
set title "Block assembly: torques of Robot2 (UR10e, simplified drives)"
set xlabel "time (s)"
set ylabel "torque / largest torque of the axis"
set yrange [0:*]
set key outside bottom center horizontal maxcols 2 spacing 1.2
set bmargin 6.5
column = "robots.Robot2.effort.shoulder_lift_joint"
eval largest
peak2 = peak
column = "robots.Robot2.effort.elbow_joint"
eval largest
peak3 = peak
plot contact using "time":(column("robots.Robot2.effort.shoulder_lift_joint") / peak2) with lines ls 3 \
       title "axis 2, level of detail 3", \
     contact using "time":(column("robots.Robot2.effort.elbow_joint") / peak3) with lines ls 5 \
       title "axis 3, level of detail 3", \
     file using "time":(column("robots.Robot2.effort.shoulder_lift_joint") / peak2) with lines ls 1 \
       title sprintf("axis 2, level of detail 2 (largest %.1f N m)", peak2), \
     file using "time":(column("robots.Robot2.effort.elbow_joint") / peak3) with lines ls 2 \
       title sprintf("axis 3, level of detail 2 (largest %.1f N m)", peak3)

# Figure 5.6 of the thesis: force that Gripper2 with its load takes from Robot2 in z over the block assembly, levels of
# detail 2 and 3.
height = 600
load "docs/figures/common.gp"
set title "Block assembly: force of Robot2 on Gripper2 and its load, in z"
set xlabel "time (s)"
set ylabel "force (N)"
set key inside bottom left
plot data."/block_assembly_lod3.csv" using "time":(-column("robots.Robot2.flange_force.z")) with lines ls 2 \
       title "level of detail 3 (contact forces)", \
     data."/block_assembly.csv" using "time":(-column("robots.Robot2.flange_force.z")) with lines ls 1 \
       title "level of detail 2 (substitute forces)"

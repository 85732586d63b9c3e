# Figure 5.6 of the thesis: force of Gripper2 in z over the block assembly, levels of detail 2 and 3.
height = 600
load "docs/figures/common.gp"
set title "Block assembly: force of Gripper2 in z"
set xlabel "time (s)"
set ylabel "force (N)"
set key inside bottom right
plot data."/block_assembly_lod3.csv" using "time":"Gripper2.force.z" with lines ls 2 \
       title "level of detail 3 (contact forces)", \
     data."/block_assembly.csv" using "time":"Gripper2.force.z" with lines ls 1 \
       title "level of detail 2 (substitute forces)"

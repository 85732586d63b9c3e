# Figure 5.10 of the thesis: torques of all axes of Robot1 (KR 16) over the block assembly, each over its largest
# magnitude; detailed drives against simplified ones on the same arm, both over the largest of the detailed ones.
height = 1200
load "docs/figures/common.gp"
detailed = data."/block_assembly_kr16.csv"
simplified = data."/block_assembly_kr16_simplified.csv"
set multiplot layout 6, 1 title "Block assembly, level of detail 2: torques of Robot1 (KR 16), over the largest with detailed drives" \
  margins 0.07, 0.80, 0.05, 0.95 spacing 0, 0.012
set offsets 0, 0, 0.05, 0.05
set format x ""
do for [i = 1:6] {
  if (i == 6) { set format x "%g"; set xlabel "time (s)" }
  torque = sprintf("robots.Robot1.effort.joint_a%d", i)
  file = detailed
  column = torque
  eval largest
  set ylabel sprintf("axis %d", i)
  plot simplified using "time":(column(torque) / peak) with lines ls 1 lw 2.5 title "simplified", \
       detailed using "time":(column(torque) / peak) with lines ls 2 lw 1 title sprintf("detailed, %.3g N m", peak)
}
unset multiplot

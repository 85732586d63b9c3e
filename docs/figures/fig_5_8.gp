# Figure 5.8 of the thesis: position of P at level of detail 3 minus that at level of detail 2.
height = 600
load "docs/figures/common.gp"
set title "Block assembly: position of P, level of detail 3 minus level of detail 2"
set xlabel "time (s)"
set ylabel "difference (mm)"
file = data."/position_differences.csv"
plot for [k = 1:3] file using "time":(1e3 * column("components.P.position.".word("x y z", k))) \
       with lines ls k title word("x y z", k)

# Figure 5.20 of the thesis: power that the furnace draws.
height = 600
load "docs/figures/common.gp"
set title "A rotor core in a furnace: power"
set xlabel "time (s)"
set ylabel "power (W)"
set xrange [0:10000]
set xtics 1000
set yrange [0:*]
plot data."/furnace.csv" using "time":"devices.Furnace.signals.power" with lines ls 1 notitle

# Figure 5.23 of the thesis: power of a robot and of two furnaces while rotors are taken apart.
height = 800
load "docs/figures/common.gp"
file = data."/bev_rotor.csv"
set multiplot layout 3, 1 title "Rotors taken apart: power" noenhanced
set xrange [0:90]
set xtics 10
set ylabel "power (W)"
set yrange [0:*]
set lmargin 10
set title "Robot1" offset 0, -0.7
plot file using "time":"power.consumers.Robot1.electrical_power" with lines ls 1 notitle
set title "Furnace1: a cold core comes"
plot file using "time":"devices.Furnace1.signals.power" with lines ls 2 notitle
set xlabel "time (s)"
set title "Furnace3: a hot core goes"
plot file using "time":"devices.Furnace3.signals.power" with lines ls 3 notitle
unset multiplot

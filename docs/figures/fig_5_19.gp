# Figure 5.19 of the thesis: temperatures of furnace, air and rotor.
height = 600
load "docs/figures/common.gp"
set title "A rotor core in a furnace: temperatures"
set xlabel "time (s)"
set ylabel "temperature (degC)"
set xrange [0:10000]
set xtics 1000
file = data."/furnace.csv"
plot file using "time":"devices.Furnace.signals.air_temperature" with lines ls 3 title "air", \
     file using "time":"devices.Furnace.signals.temperature" with lines ls 1 title "furnace", \
     file using "time":"devices.Rotor_heat.signals.temperature" with lines ls 2 title "rotor"

# Clearance: how far beside its seat's middle the motor is, by clearance.
set terminal pngcairo size 560,320 font "sans,9"
set output out
set datafile separator ","
set grid lc rgb "#dddddd"
set key top right

set title "Beside the middle of its seat, by radial clearance"
set xlabel "time (s)"
set ylabel "distance (mm)"
set xrange [0:0.6]
away(x, y) = 1e3 * sqrt(x * x + y * y)
plot data."/wide.csv" using "time":(away(column("components.Motor.position.x"), column("components.Motor.position.y"))) with lines lc rgb "#d62728" title "0.5 mm", \
     data."/fine.csv" using "time":(away(column("components.Motor.position.x"), column("components.Motor.position.y"))) with lines lc rgb "#1f77b4" title "0.1 mm", \
     data."/close.csv" using "time":(away(column("components.Motor.position.x"), column("components.Motor.position.y"))) with lines lc rgb "#2ca02c" title "0.03 mm"

# Sharp edges: the force between motor and housing while it drops into its seat.
set terminal pngcairo size 560,320 font "sans,9"
set output out
set datafile separator ","
set grid lc rgb "#dddddd"
set key top right

set title "A motor drops into its seat: chamfers of 1 mm and of 0.1 mm"
set xlabel "time (s)"
set ylabel "normal force (N)"
set xrange [0:0.3]
plot data."/sharp.csv" using "time":"contacts.contacts.Motor-Housing.normal_force" with lines lc rgb "#d62728" title "0.1 mm", \
     data."/fine.csv" using "time":"contacts.contacts.Motor-Housing.normal_force" with lines lc rgb "#1f77b4" title "1 mm"

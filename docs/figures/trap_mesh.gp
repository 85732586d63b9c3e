# Mesh size: the same with elements along the bore of 1 mm and 5 mm, 80 and 20 flats around.
set terminal pngcairo size 560,320 font "sans,9"
set output out
set datafile separator ","
set grid lc rgb "#dddddd"
set key top right

set title "The same: elements of 1 mm and 80 flats, of 5 mm and 20 flats"
set xlabel "time (s)"
set ylabel "normal force (N)"
set xrange [0:0.3]
plot data."/coarse.csv" using "time":"contacts.contacts.Motor-Housing.normal_force" with lines lc rgb "#d62728" title "5 mm, 20 flats", \
     data."/fine.csv" using "time":"contacts.contacts.Motor-Housing.normal_force" with lines lc rgb "#1f77b4" title "1 mm, 80 flats"

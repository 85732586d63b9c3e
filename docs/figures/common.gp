# What all figures share. Called with the variables `data` (directory of the CSV files) and `out` (PNG file).
set terminal pngcairo size 1200, height font "sans,11" background rgb "white"
set output out
set datafile separator ","
set datafile columnheaders
set grid xtics ytics lt 1 lc rgb "#cccccc" lw 0.7
set xrange [0:42]
set xtics 5
set key outside right top samplen 2
set style line 1 lc rgb "#1f5fbf" lw 1.6
set style line 2 lc rgb "#d1351b" lw 1.6
set style line 3 lc rgb "#2c8c3c" lw 1.6
set style line 4 lc rgb "#8a4fbf" lw 1.6
set style line 5 lc rgb "#c98a00" lw 1.6
set style line 6 lc rgb "#555555" lw 1.6
# Largest magnitude in a column.
peak = 0.0
largest = 'stats [*:*][*:*] file using column nooutput; peak = abs(STATS_max) > abs(STATS_min) ? abs(STATS_max) : abs(STATS_min)'
